// When there is something to see, over a link in virtual time: our FM0, and the whole model as one Draco file.
#pragma once

#include <memory>

#include "client/session/draco_peer.h"
#include "client/session/virtual_link.h"
#include "tests/bench/open_asset.h"

namespace fanstream::bench {

// In seconds. Over both links a connection is made first, which takes a round trip. Ours then greets the server, which
// takes another, and asks for the model; Draco's file is asked for at once.
struct FirstImage {
  double ours_s = 0.0;     // from the first packet of the connect until FM0 can be drawn
  double request_s = 0.0;  // of that, until the model is asked for
  double decode_s = 0.0;   // of that, reading the head and FM0's triangles: CPU time, median
  PeerDownload draco;      // from its first packet
  double draco_request_s = 0.0;

  double ratio() const { return ours_s / draco.picture_s(); }
  double asked_s() const { return ours_s - request_s; }  // from the moment the request is sent
  double draco_asked_s() const { return draco.picture_s() - draco_request_s; }
  double asked_ratio() const { return asked_s() / draco_asked_s(); }
};

// Fails where the head does not come or cannot be read.
Result<FirstImage> measure_first_image(const std::shared_ptr<const OpenAsset>& asset, const DracoFile& draco,
                                       const VirtualLinkOptions& link, int repetitions = 5);

}  // namespace fanstream::bench
