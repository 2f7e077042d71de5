// A server that goes away: passes everything on to a real one, for one client, and breaks off after so many bytes.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
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

// The same for any number of connections, one after another: each gets bytes_of(n), from n = 0, before it is cut off.
class RepeatedlyCuttingRelay {
 public:
  RepeatedlyCuttingRelay(std::uint16_t server_port, std::function<std::size_t(unsigned)> bytes_of)
      : thread_([this, server_port, bytes_of = std::move(bytes_of)] {
          for (unsigned n = 0;; ++n) {
            RawSocket client = listener_.accept();
            if (stopping_) return;
            ++connections_;
            carry(std::move(client), RawSocket::connect(server_port), bytes_of(n));
          }
        }) {}
  ~RepeatedlyCuttingRelay() {
    stopping_ = true;
    RawSocket::connect(listener_.port());
    thread_.join();
  }
  std::uint16_t port() const { return listener_.port(); }
  unsigned connections() const { return connections_; }

 private:
  static void carry(RawSocket client, RawSocket server, std::size_t left) {
    std::thread up([&] {
      for (auto bytes = client.receive_next(); !bytes.empty(); bytes = client.receive_next()) server.send(bytes);
      server.half_close();
    });
    while (left > 0) {
      auto bytes = server.receive_next();
      if (bytes.empty()) break;
      bytes.resize(std::min(bytes.size(), left));
      left -= bytes.size();
      if (!client.send(bytes)) break;
    }
    client.half_close();
    up.join();  // the client closes when it notices
  }

  RawListener listener_;
  std::atomic<bool> stopping_{false};
  std::atomic<unsigned> connections_{0};
  std::thread thread_;
};

}  // namespace fanstream::testing
