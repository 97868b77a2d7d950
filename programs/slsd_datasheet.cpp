// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#include "programs/carry_out.hpp"
#include "programs/datasheet/make_datasheet.hpp"

int main(int argc, char** argv) {
  return slsd::carry_out(argc, argv, "datasheet", slsd::kDatasheetPurpose, &slsd::add_datasheet_options,
                         &slsd::make_datasheet);
}
