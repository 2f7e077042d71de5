// Pictures side by side with captions, to compare levels at a glance.
#pragma once

#include <string>
#include <vector>

#include "client/render/image.h"

namespace fanstream {

struct ContactSheetEntry {
  Image image;
  std::vector<std::string> caption;  // the first line stands out; lines too wide for the image are set smaller
};

struct ContactSheetOptions {
  std::string title{};          // above everything, left out where empty
  std::uint32_t columns = 0;  // 0: a grid about as wide as it is high
  double text_height_px = 17.0;
  std::uint32_t gap_px = 16;
};

// All images of one size, at least one. Fails (usage) for images of unequal or no size, and (limit) where the sheet
// would exceed 16,384 pixels a side or 64 million pixels.
Result<Image> make_contact_sheet(const std::vector<ContactSheetEntry>& entries,
                                 const ContactSheetOptions& options = {});

}  // namespace fanstream
