// The session of `fanstream-client session`: a model that follows the view, fed by a transport.
#pragma once

#include "client/session/session_transport.h"
#include "client/session/view_session.h"

namespace fanstream {

// A session over a transport. `settings` gives the picture's size and the budgets.
std::unique_ptr<ViewSession> live_session(std::unique_ptr<SessionTransport> transport, const SessionSettings& settings);

// A SessionOpener: in virtual time over a simulated link, whatever the source (a server's model is received first and
// then served again), else from the source as it is.
Result<OpenedSession> open_live_session(const SessionSettings& settings);

}  // namespace fanstream
