// A server that goes away: passes everything on to a real one, for one client, and breaks off after so many bytes.
#pragma once

#include <cstdint>
#include <thread>

#include "tests/support/raw_socket.h"

namespace fanstream::testing {

class CuttingRelay {
 public:
  CuttingRelay(std::uint16_t server_port, std::size_t bytes_to_client)
      : down_([this, server_port, bytes_to_client] {
          RawSocket client = listener_.accept();
          RawSocket server = RawSocket::connect(server_port);
          std::thread up([&] {
            for (auto bytes = client.receive_next(); !bytes.empty(); bytes = client.receive_next()) server.send(bytes);
          });
          std::size_t left = bytes_to_client;
          while (left > 0) {
            auto bytes = server.receive_next();
            if (bytes.empty()) break;
            bytes.resize(std::min(bytes.size(), left));
            left -= bytes.size();
            if (!client.send(bytes)) break;
          }
          client.half_close();
          up.join();
        }) {}
  ~CuttingRelay() { down_.join(); }
  std::uint16_t port() const { return listener_.port(); }

 private:
  RawListener listener_;
  std::thread down_;
};

}  // namespace fanstream::testing
