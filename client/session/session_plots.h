// A session's curves beside the peer's, as pictures.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "client/render/plot.h"
#include "client/session/session_record.h"

namespace fanstream {

// The stated error of every frame in pixels, down a logarithmic axis, against the bytes received or the time; the
// wanted tolerance; and Draco, which shows nothing until its whole file is there (and, against time, decoded) and is
// exact from then on. Fails (usage) without frames, else as draw_plot.
Result<Image> plot_error_by_bytes(const std::string& title, std::span<const FrameRecord> frames,
                                  const std::optional<PeerDownload>& draco);
Result<Image> plot_error_by_time(const std::string& title, std::span<const FrameRecord> frames,
                                 const std::optional<PeerDownload>& draco);

}  // namespace fanstream
