// Arbitrary bytes into the server's and the client's session machine, between arbitrary acts of their users and of the
// clock. Input: a sequence of (act byte, size byte, bytes). Frames of the right form are made likely by fixing
// checksums up.
#include <array>
#include <cstdlib>
#include <memory>
#include <vector>

#include "protocol/client_session.h"
#include "protocol/server_session.h"

using namespace fanstream;

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

class SmallSource final : public SegmentSource {
 public:
  SmallSource() : blob_(200'000, std::byte{5}) {}
  Digest digest() const override { return {}; }
  Bytes head() const override { return Bytes(blob_).first(70'000); }
  Bytes index() const override { return Bytes(blob_).first(10); }
  std::uint32_t cell_count() const override { return 9; }
  std::uint32_t segment_count(std::uint32_t cell) const override { return cell % 4; }
  Bytes segment(std::uint32_t cell, std::uint32_t segment) const override {
    return Bytes(blob_).first(cell == 7 ? 200'000 : segment == 1 ? 0 : cell * 10 + segment);
  }
  std::uint64_t vertex_count() const override { return 1; }
  std::uint64_t triangle_count() const override { return 1; }
  std::uint64_t size_bytes() const override { return 1; }

 private:
  std::vector<std::byte> blob_;
};

// Acts and their bytes, from the fuzzer's input.
struct Script {
  Bytes rest;
  std::uint8_t byte() {
    if (rest.empty()) return 0;
    const auto value = std::to_integer<std::uint8_t>(rest[0]);
    rest = rest.subspan(1);
    return value;
  }
  Bytes bytes() {
    const std::size_t wanted = byte();  // first: it shortens the rest
    const std::size_t size = std::min(wanted, rest.size());
    const Bytes value = rest.first(size);
    rest = rest.subspan(size);
    return value;
  }
};

void drive_server(Script script) {
  static const auto source = std::make_shared<const SmallSource>();
  ServerSession server({}, 0);
  TimeMs now_ms = 0;
  std::vector<std::byte> scratch;
  const auto serve = [&] {
    while (const std::optional<ServerEvent> event = server.next_event(now_ms)) {
      if (std::holds_alternative<ListRequested>(*event))
        server.send_catalogue({{"m", ModelState::failed, 0, "r"}});
      else if (std::get<OpenRequested>(*event).model == "x")
        server.open_failed(ErrorCode::unknown_model, "x");
      else if (std::get<OpenRequested>(*event).model != "w")
        server.open_ready(source);
    }
  };
  std::vector<std::byte> hello;
  encode(Hello{}, hello);
  if (script.byte() % 8 != 0) server.receive(hello, 0);
  while (!script.rest.empty()) {
    switch (script.byte() % 5) {
      case 0:
      case 1: {  // a frame: type, payload
        const auto type = static_cast<FrameType>(script.byte());
        if (server.wants_to_receive() && !is_data_frame(type)) {
          std::vector<std::byte> frame;
          write_frame(type, script.bytes(), frame);
          server.receive(frame, now_ms);
        }
        serve();
        break;
      }
      case 2:
        if (server.wants_to_receive()) server.receive(script.bytes(), now_ms);
        serve();
        break;
      case 3: {
        std::array<Bytes, 16> buffers;
        const std::uint64_t credit_before = server.credit_bytes();
        std::size_t total = 0;
        for (const Bytes& buffer : std::span(buffers).first(server.next_write(buffers, scratch)))
          total += buffer.size();
        require(server.credit_bytes() <= credit_before);
        server.written(total * script.byte() / 255, now_ms);
        serve();
        break;
      }
      case 4:
        now_ms += script.byte() * 100;
        server.tick(now_ms);
        if (server.pending_open()) server.open_building(0.5, now_ms);
        break;
    }
  }
}

// Of SmallSource, so that what the one machine says can be taken by the other.
std::shared_ptr<const SegmentTable> small_table() {
  const SmallSource source;
  auto table = std::make_shared<SegmentTable>();
  for (std::uint32_t cell = 0; cell < source.cell_count(); ++cell) {
    std::vector<std::uint32_t> sizes;
    for (std::uint32_t segment = 0; segment < source.segment_count(cell); ++segment)
      sizes.push_back(static_cast<std::uint32_t>(source.segment(cell, segment).size()));
    table->add_cell(sizes);
  }
  return table;
}

void drive_client(Script script) {
  static const std::shared_ptr<const SegmentTable> table = small_table();
  ClientSession client({}, 0);
  TimeMs now_ms = 0;
  const auto take = [&] {
    while (const std::optional<ClientEvent> event = client.next_event()) {
      if (std::holds_alternative<event::Welcomed>(*event)) (void)client.open("model");
      if (std::holds_alternative<event::ModelOpened>(*event)) (void)client.set_wants({{0, 9, kAllSegments}});
      if (std::holds_alternative<event::IndexComplete>(*event)) (void)client.set_segment_table(table);
      if (const auto* arrived = std::get_if<event::SegmentArrived>(&*event)) {
        require(arrived->bytes.size() == table->size_bytes(arrived->cell, arrived->segment));
        require(client.held_prefix(arrived->cell) > arrived->segment);
      }
    }
  };
  std::vector<std::byte> welcome;
  encode(Welcome{}, welcome);
  if (script.byte() % 8 != 0) client.receive(welcome, 0);
  take();
  while (!script.rest.empty()) {
    switch (script.byte() % 6) {
      case 0: {  // a control frame
        const auto type = static_cast<FrameType>(script.byte());
        if (is_data_frame(type)) break;
        std::vector<std::byte> frame;
        write_frame(type, script.bytes(), frame);
        client.receive(frame, now_ms);
        take();
        break;
      }
      case 1: {  // a data frame with a right checksum
        constexpr std::array kTypes = {FrameType::head_data, FrameType::index_data, FrameType::segments,
                                       FrameType::segment_part};
        const FrameType type = kTypes[script.byte() % 4];
        const std::array<std::uint32_t, 3> fields{script.byte(), script.byte(), script.byte()};
        const std::size_t count = type == FrameType::segments || type == FrameType::segment_part ? 3 : 1;
        const Bytes blob = script.bytes();
        client.receive(DataFrameHeader(type, std::span(fields).first(count), blob).bytes(), now_ms);
        client.receive(blob, now_ms);
        take();
        break;
      }
      case 2: client.receive(script.bytes(), now_ms), take(); break;
      case 3: client.written(client.pending_output().size() * script.byte() / 255); break;
      case 4: client.tick(now_ms += script.byte() * 100), take(); break;
      case 5:
        if (!client.welcomed() || client.failed()) break;
        (void)client.set_wants({{script.byte(), 1, script.byte()}});
        (void)client.release({{script.byte(), 1, script.byte()}});
        break;
    }
  }
  client.transport_closed("closed");
  take();
  require(client.failed());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes input = std::as_bytes(std::span(data, size));
  drive_server({input});
  drive_client({input});
  return 0;
}
