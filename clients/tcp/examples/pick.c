/* SPDX-License-Identifier: Apache-2.0 */
/* Copyright the slsd authors */
/* Finds one part on a table with slsd-tcp: C99 and POSIX sockets, no libraries.

     cc -std=c99 -O2 pick.c -lm -o pick
     ./pick 192.168.1.10 8385 MY-TOKEN-OF-16-CHARACTERS

   Prints the place to grip in the robot's frame, in mm, and the turn of the part's longer side in degrees. */
#define _POSIX_C_SOURCE 200112L
#include <math.h>
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

/* ---- What to change: the scanner in the robot's frame, from its hand-eye calibration, and where parts may lie ---- */
#ifndef BASE_FROM_SCANNER
#define BASE_FROM_SCANNER {{1, 0, 0, 400}, {0, -1, 0, 0}, {0, 0, -1, 1200}} /* rotation and place, mm */
#endif
#ifndef PARTS_MIN
#define PARTS_MIN {200, -200, 5} /* a corner of the box, mm: its floor is just above the table */
#define PARTS_MAX {600, 200, 150}
#endif
enum { kPointsMin = 20, kTimeoutS = 30, kLineMax = 65536 };

static const double base_from_scanner[3][4] = BASE_FROM_SCANNER;
static const double parts_min[3] = PARTS_MIN, parts_max[3] = PARTS_MAX;

static void give_up(const char* what, const char* details) {
  fprintf(stderr, "pick: %s%s%s\n", what, details[0] ? ": " : "", details);
  exit(1);
}

static FILE* connect_to(const char* host, const char* port) {
  struct addrinfo hints = {0}, *found = NULL;
  const struct timeval timeout = {kTimeoutS, 0};
  int number;
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(host, port, &hints, &found) != 0) give_up("no such address", host);
  number = socket(found->ai_family, found->ai_socktype, found->ai_protocol);
  if (number < 0) give_up("no socket", "");
  setsockopt(number, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  setsockopt(number, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
  if (connect(number, found->ai_addr, found->ai_addrlen) != 0) give_up("nothing answers there", host);
  freeaddrinfo(found);
  return fdopen(number, "r+");
}

static void send_line(FILE* scanner, const char* line) {
  if (fprintf(scanner, "%s\n", line) < 0 || fflush(scanner) != 0)
    give_up("cannot send", "");
}

/* A line of the protocol, or of the cloud's header. */
static const char* read_line(FILE* scanner) {
  static char line[kLineMax];
  if (!fgets(line, sizeof line, scanner)) give_up("the scanner closed the connection, or is silent", "");
  line[strcspn(line, "\n")] = 0;
  return line;
}

/* The number of points, and of bytes for each, by the header of a PLY file. The first three are x y z. */
static long read_header(FILE* scanner, long* bytes_of_point) {
  long points = -1;
  *bytes_of_point = 0;
  while (1) {
    const char* line = read_line(scanner);
    sscanf(line, "element vertex %ld", &points);
    if (strncmp(line, "property ", 9) == 0) *bytes_of_point += strncmp(line + 9, "uchar ", 6) == 0 ? 1 : 4;
    if (strcmp(line, "end_header") == 0) break;
  }
  if (points < 0 || *bytes_of_point < 12 || *bytes_of_point > 256) give_up("the cloud has no header", "");
  return points;
}

/* PLY is little-endian, whatever this machine is. */
static double number_at(const unsigned char* bytes) {
  const unsigned long bits = bytes[0] | bytes[1] << 8 | bytes[2] << 16 | (unsigned long)bytes[3] << 24;
  const int exponent = (int)(bits >> 23 & 255);
  const double size = ldexp((double)(bits & 0x7fffff) + (exponent ? 0x800000 : 0), (exponent ? exponent : 1) - 150);
  return bits >> 31 & 1 ? -size : size;
}

/* The point in the robot's frame. Returns whether it belongs to a part. */
static int place(const unsigned char* bytes, double point[3]) {
  int inside = 1;
  for (int row = 0; row < 3; ++row) {
    const double* pose = base_from_scanner[row];
    point[row] = pose[3];
    for (int axis = 0; axis < 3; ++axis) point[row] += pose[axis] * number_at(bytes + 4 * axis);
    inside = inside && point[row] >= parts_min[row] && point[row] <= parts_max[row];
  }
  return inside;
}

int main(int argc, char** argv) {
  char greeting[2048];
  long bytes_of_point, points, found = 0;
  double sum[3] = {0}, square_xx = 0, square_xy = 0, square_yy = 0;
  FILE* scanner;
  if (argc != 4) {
    fprintf(stderr, "usage: pick ADDRESS PORT TOKEN\n");
    return 2;
  }
  scanner = connect_to(argv[1], argv[2]);
  if (!scanner) give_up("no memory", "");
  /* Without an id the token gets no answer, unless it is wrong. */
  snprintf(greeting, sizeof greeting,
           "{\"jsonrpc\":\"2.0\",\"method\":\"authenticate\",\"params\":{\"token\":\"%s\"}}", argv[3]);
  send_line(scanner, greeting);
  send_line(scanner, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"scan\",\"params\":{\"density\":\"symbols\"}}");
  const char* answer = read_line(scanner);
  if (!strstr(answer, "\"result\":")) give_up("no scan", answer);
  points = read_header(scanner, &bytes_of_point);
  for (long i = 0; i < points; ++i) {
    unsigned char bytes[256];
    double point[3];
    if (fread(bytes, (size_t)bytes_of_point, 1, scanner) != 1) give_up("the cloud ends too soon", "");
    if (!place(bytes, point)) continue;
    ++found;
    for (int axis = 0; axis < 3; ++axis) sum[axis] += point[axis];
    square_xx += point[0] * point[0];
    square_xy += point[0] * point[1];
    square_yy += point[1] * point[1];
  }
  fclose(scanner);
  if (found < kPointsMin) give_up("no part lies there", "");
  for (int axis = 0; axis < 3; ++axis) sum[axis] /= (double)found;
  square_xx = square_xx / (double)found - sum[0] * sum[0];
  square_xy = square_xy / (double)found - sum[0] * sum[1];
  square_yy = square_yy / (double)found - sum[1] * sum[1];
  printf("x %.2f y %.2f z %.2f mm, turned %.2f degrees, %ld points\n", sum[0], sum[1], sum[2],
         atan2(2 * square_xy, square_xx - square_yy) / 2 * 57.29577951308232, found);
  return 0;
}
