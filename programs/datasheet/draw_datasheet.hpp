// SPDX-License-Identifier: Apache-2.0
// Copyright the slsd authors
#pragma once

#include <string>
#include <vector>

#include "core/datasheet/summary.hpp"
#include "core/result.hpp"

namespace slsd {

/// A figure of the sheet, and its value at each place.
struct Quantity {
  std::string name, source;  ///< "Probing error, form", "VDI/VDE 2634-2: PF"
  std::string unit;          ///< "mm", or empty
  std::vector<double> values;
  Summary summary;
};

struct DataSheet {
  std::vector<std::string> facts;  ///< lines on what was measured, when and with what
  std::vector<Quantity> quantities;
  std::vector<std::string> places;  ///< a line for each cloud
};

/// A page of A4 as a PDF: the facts, a table, the value at each place as dots, and the places.
/// @errors kIo: the drawing library failed
/// @thread reentrant
[[nodiscard]] Result<std::string> datasheet_pdf(const DataSheet& sheet);

/// A value with its sign, as the sheet shows it: "+0.021", or "-" if it is not finite.
[[nodiscard]] std::string signed_text(double value);

}  // namespace slsd
