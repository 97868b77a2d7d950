// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "drivers/projector/texel_painter.hpp"

#include <string>
#include <vector>

#include <GLES3/gl3.h>

namespace slsd {
namespace {

constexpr const char* kVertexShader = R"(#version 300 es
void main() {  // one triangle that covers everything: a seam between two could draw a pixel twice or not at all
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
})";

constexpr const char* kFragmentShader = R"(#version 300 es
precision highp float;
precision highp int;
uniform highp sampler2D image;
out vec4 colour;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  int row = textureSize(image, 0).y - 1 - pixel.y;
  colour = vec4(vec3(texelFetch(image, ivec2(pixel.x, row), 0).r), 1.0);
})";

Result<GLuint> compile(GLenum kind, const char* source) {
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  char log[512] = "";
  glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  return fail(ErrorCode::kUnsupported, std::string("the graphics driver refuses the shader: ") + log);
}

}  // namespace

Result<TexelPainter> TexelPainter::create(int width_px, int height_px, const LightCurve& curve) {
  GLint side_max_px = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side_max_px);
  if (width_px > side_max_px || height_px > side_max_px) {
    return fail(ErrorCode::kUnsupported,
                "the graphics driver draws at most " + std::to_string(side_max_px) + " pixels per side");
  }
  TexelPainter painter(width_px, height_px, curve);
  if (auto made = painter.make_program(); !made) return tl::unexpected(made.error());
  painter.make_texture();
  glDisable(GL_DITHER);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  if (glGetError() != GL_NO_ERROR) return fail(ErrorCode::kUnsupported, "the graphics driver lacks OpenGL ES 3");
  return painter;
}

Result<> TexelPainter::make_program() {
  const auto vertex = compile(GL_VERTEX_SHADER, kVertexShader);
  if (!vertex) return tl::unexpected(vertex.error());
  const auto fragment = compile(GL_FRAGMENT_SHADER, kFragmentShader);
  if (!fragment) return tl::unexpected(fragment.error());
  program_ = glCreateProgram();
  for (const GLuint shader : {*vertex, *fragment}) {
    glAttachShader(program_, shader);
    glDeleteShader(shader);
  }
  glLinkProgram(program_);
  GLint linked = GL_FALSE;
  glGetProgramiv(program_, GL_LINK_STATUS, &linked);
  if (linked != GL_TRUE) return fail(ErrorCode::kUnsupported, "the graphics driver does not link the shaders");
  return {};
}

void TexelPainter::make_texture() {
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_R8, width_px_, height_px_);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

void TexelPainter::load(const Grey8& image) {
  glBindTexture(GL_TEXTURE_2D, texture_);
  const Grey8 sent = curve_.is_identity() ? Grey8() : curve_.apply(image);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_px_, height_px_, GL_RED, GL_UNSIGNED_BYTE,
                  sent.empty() ? image.data() : sent.data());
}

void TexelPainter::draw() {
  glViewport(0, 0, width_px_, height_px_);
  glUseProgram(program_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glFinish();
}

Grey8 TexelPainter::read() const {
  const auto pixels = static_cast<std::size_t>(width_px_) * height_px_;
  std::vector<std::uint8_t> rgba(4 * pixels);
  glReadPixels(0, 0, width_px_, height_px_, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  Grey8 image(width_px_, height_px_);
  const std::uint8_t* green = rgba.data() + 1;
  for (int y = height_px_ - 1; y >= 0; --y) {  // OpenGL reads from the bottom up
    for (int x = 0; x < width_px_; ++x, green += 4) image.at(x, y) = *green;
  }
  return image;
}

}  // namespace slsd
