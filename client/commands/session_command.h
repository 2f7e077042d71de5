// The session command. Whoever registers it says how sessions are opened.
#pragma once

#include "client/commands/commands.h"
#include "client/session/view_session.h"

namespace fanstream {

Command add_session_command(CLI::App& app, SessionOpener opener);

}  // namespace fanstream
