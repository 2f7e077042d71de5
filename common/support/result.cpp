#include "common/support/result.h"

namespace fanstream {

int exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage: return 2;
    case ErrorKind::not_found: return 3;
    case ErrorKind::io: return 4;
    case ErrorKind::bad_input: return 5;
    case ErrorKind::unsupported: return 6;
    case ErrorKind::limit: return 7;
    case ErrorKind::network: return 8;
    case ErrorKind::interrupted: return 130;
  }
  return 1;
}

std::string_view name(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage: return "usage";
    case ErrorKind::not_found: return "not found";
    case ErrorKind::io: return "i/o";
    case ErrorKind::bad_input: return "bad input";
    case ErrorKind::unsupported: return "unsupported";
    case ErrorKind::limit: return "limit";
    case ErrorKind::network: return "network";
    case ErrorKind::interrupted: return "interrupted";
  }
  return "unknown";
}

Error with_context(Error error, std::string_view context) {
  error.message.insert(0, std::string(context) + ": ");
  return error;
}

}  // namespace fanstream
