// Recoverable errors: every function that can fail on outside input returns Result<T>.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace fanstream {

// What kind of thing went wrong. Programs turn it into their exit code, the protocol into its error code.
enum class ErrorKind {
  usage,        // the caller asked for something impossible (bad option, unknown model)
  not_found,    // the file or model does not exist
  io,           // reading or writing failed (disk full, no permission)
  bad_input,    // the bytes are not what they claim to be
  unsupported,  // well-formed, but a version or feature that this program does not know
  limit,        // larger than a stated limit
  network,      // the peer is gone, refused, or timed out
  interrupted,  // stopped by the user
};

// `message` names the input and the place in it ("bunny.ply: byte 812: ...") and says what to do next where it can.
struct Error {
  ErrorKind kind = ErrorKind::bad_input;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> fail(ErrorKind kind, std::string message) {
  return tl::unexpected<Error>(Error{kind, std::move(message)});
}

// The process exit code of each kind: 2 usage, 3 not found, 4 io, 5 bad input, 6 unsupported, 7 limit, 8 network, 130
// interrupted.
int exit_code(ErrorKind kind);

// "bad input", "not found", ...
std::string_view name(ErrorKind kind);

// The same error with "context: " before its message.
Error with_context(Error error, std::string_view context);

}  // namespace fanstream
