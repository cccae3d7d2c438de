// What a worker sends is trusted in nothing.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <functional>

#include "firmware-host/camera_worker/camera_messages.h"
#include "tests/support/worker_bench.h"

namespace scan {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

Frame SampleFrame() {
  Frame frame;
  frame.files.push_back({"jpg", std::vector<std::byte>(300'000, std::byte{7})});
  frame.files.push_back({"nef", std::vector<std::byte>(1, std::byte{9})});
  frame.sensor_sequence = 0xffff'ffff'ffff'fff0U;
  frame.exposure = {9'000'000'000'000'000'123, 9'000'000'000'000'000'456, ExposureSource::hot_shoe};
  frame.applied.exposure_us = 8000.125;
  return frame;
}

TEST(WorkerFrame, ComesThroughUnchanged) {
  auto sockets = WorkerSocketPair();
  ASSERT_TRUE(sockets);
  WorkerLink here(std::move(sockets->first)), there(std::move(sockets->second));
  const Frame frame = SampleFrame();
  auto packed = PackFrame(frame);
  ASSERT_TRUE(packed);
  ASSERT_TRUE(there.Send(*packed));
  auto message = here.Receive(1000ms);
  ASSERT_TRUE(message && *message);
  const auto unpacked = UnpackFrame((*message)->body, (*message)->files, 1 << 20);
  ASSERT_TRUE(unpacked) << ToString(unpacked.error());
  EXPECT_EQ(unpacked->files, frame.files);
  EXPECT_EQ(unpacked->sensor_sequence, frame.sensor_sequence);
  EXPECT_EQ(unpacked->exposure, frame.exposure);
  EXPECT_EQ(unpacked->applied, frame.applied);
}

struct Damage {
  const char *name, *refused_for;
  std::function<void(WorkerMessage&)> inflict;
};

UniqueFd MemFd(std::size_t bytes, unsigned seals) {
  UniqueFd fd(::memfd_create("test", MFD_ALLOW_SEALING));
  EXPECT_EQ(::ftruncate(fd.get(), static_cast<off_t>(bytes)), 0);
  if (seals) ::fcntl(fd.get(), F_ADD_SEALS, seals);
  return fd;
}

const Damage kDamages[] = {
    {"no_files", "do not match", [](WorkerMessage& m) { m.files.clear(); }},
    {"one_file_too_few", "do not match", [](WorkerMessage& m) { m.files.pop_back(); }},
    {"files_is_a_number", "do not match", [](WorkerMessage& m) { m.body["files"] = 2; }},
    {"files_holds_numbers", "cannot use at()",
     [](WorkerMessage& m) {
       m.body["files"] = {1, 2};
     }},
    {"path_as_extension", "kind of picture",
     [](WorkerMessage& m) { m.body["files"][0]["extension"] = "../a"; }},
    {"extension_is_a_number", "must be string",
     [](WorkerMessage& m) { m.body["files"][0]["extension"] = 1; }},
    {"longer_than_the_file", "300001 are stated",
     [](WorkerMessage& m) { m.body["files"][0]["bytes"] = 300'001; }},
    {"shorter_than_the_file", "299999 are stated",
     [](WorkerMessage& m) { m.body["files"][0]["bytes"] = 299'999; }},
    {"huge", "a picture of", [](WorkerMessage& m) { m.body["files"][0]["bytes"] = 1ULL << 60; }},
    {"negative_length", "no count", [](WorkerMessage& m) { m.body["files"][0]["bytes"] = -1; }},
    {"empty", "a picture of 0", [](WorkerMessage& m) { m.body["files"][0]["bytes"] = 0; }},
    {"fractional_length", "no count",
     [](WorkerMessage& m) { m.body["files"][0]["bytes"] = 300'000.5; }},
    {"huge_file", "a picture of 67108864",
     [](WorkerMessage& m) {
       m.files[0] = MemFd(64 << 20, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL);
       m.body["files"][0]["bytes"] = 64 << 20;
     }},
    {"unsealed", "no sealed", [](WorkerMessage& m) { m.files[0] = MemFd(300'000, 0); }},
    {"a_pipe", "no sealed",
     [](WorkerMessage& m) {
       int ends[2];
       ASSERT_EQ(::pipe(ends), 0);
       m.files[0].Reset(ends[0]);
       ::close(ends[1]);
     }},
    {"a_device", "no sealed",
     [](WorkerMessage& m) { m.files[0].Reset(::open("/dev/zero", O_RDONLY | O_CLOEXEC)); }},
    {"time_beyond_range", "no whole number",
     [](WorkerMessage& m) { m.body["exposure"]["not_before_ns"] = -1e300; }},
    {"time_is_a_fraction", "no whole number",
     [](WorkerMessage& m) { m.body["exposure"]["not_after_ns"] = 9'100'000'000'000'000'000.0; }},
    {"unknown_source", "unknown source",
     [](WorkerMessage& m) { m.body["exposure"]["source"] = "guess"; }},
    {"ends_before_it_begins", "ends before",
     [](WorkerMessage& m) { m.body["exposure"]["not_after_ns"] = 1; }},
    {"no_exposure", "exposure", [](WorkerMessage& m) { m.body.erase("exposure"); }},
    {"exposure_is_a_list", "cannot use at()",
     [](WorkerMessage& m) { m.body["exposure"] = Json::array(); }},
    {"sequence_is_negative", "no count", [](WorkerMessage& m) { m.body["sensor_sequence"] = -1; }},
    {"sequence_beyond_range", "no count",
     [](WorkerMessage& m) { m.body["sensor_sequence"] = 1e300; }},
    {"sequence_is_a_word", "no count", [](WorkerMessage& m) { m.body["sensor_sequence"] = "one"; }},
    {"applied_is_a_word", "gain is no number",
     [](WorkerMessage& m) { m.body["applied"]["gain"] = "much"; }},
    {"applied_is_negative", "no number",
     [](WorkerMessage& m) { m.body["applied"]["exposure_us"] = -2; }},
    {"applied_is_null", "no number",
     [](WorkerMessage& m) { m.body["applied"]["exposure_us"] = nullptr; }},
};

class DamagedFrame : public ::testing::TestWithParam<Damage> {};

TEST_P(DamagedFrame, IsRefused) {
  auto packed = PackFrame(SampleFrame());
  ASSERT_TRUE(packed);
  GetParam().inflict(*packed);
  const auto frame = UnpackFrame(packed->body, packed->files, 1 << 20);
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::bad_input);
  EXPECT_NE(frame.error().what.find(GetParam().refused_for), std::string::npos)
      << frame.error().what;
}

INSTANTIATE_TEST_SUITE_P(All, DamagedFrame, ::testing::ValuesIn(kDamages),
                         [](const auto& instance) { return std::string(instance.param.name); });

// Peers that speak no protocol at all: each gets one packet read, then sends this.
struct Peer {
  const char* name;
  std::function<void(int socket, std::int64_t id)> speak;
};

void SendText(int socket, const std::string& text) {
  (void)::send(socket, text.data(), text.size(), MSG_NOSIGNAL);
}

const Peer kPeers[] = {
    {"closes", [](int, std::int64_t) {}},
    {"nothing", [](int socket, std::int64_t) { SendText(socket, ""); }},
    {"binary", [](int socket, std::int64_t) { SendText(socket, std::string(200, '\xff')); }},
    {"list", [](int socket, std::int64_t) { SendText(socket, "[1,2]"); }},
    {"deep", [](int socket, std::int64_t) { SendText(socket, std::string(60'000, '[')); }},
    {"too_long", [](int socket, std::int64_t) { SendText(socket, std::string(100'000, ' ')); }},
    {"no_outcome",
     [](int socket, std::int64_t id) {
       SendText(socket, Json{{"id", id}}.dump());
     }},
    {"ok_is_a_word",
     [](int socket, std::int64_t id) {
       SendText(socket, Json{{"id", id}, {"ok", "y"}}.dump());
     }},
    {"info_without_size",
     [](int socket, std::int64_t id) {
       SendText(socket, Json{{"id", id}, {"ok", {{"id", "a"}, {"model", "b"}}}}.dump());
     }},
    {"info_of_nonsense_size",
     [](int socket, std::int64_t id) {
       const Json info = {{"id", "a"}, {"model", "b"}, {"w", -4}, {"h", 1'000'000'000}};
       SendText(socket, Json{{"id", id}, {"ok", info}}.dump());
     }},
    {"info_of_a_size_beyond_range",
     [](int socket, std::int64_t id) {
       const Json info = {{"id", "a"}, {"model", "b"}, {"w", 1e300}, {"h", 80}};
       SendText(socket, Json{{"id", id}, {"ok", info}}.dump());
     }},
    {"many_descriptors",
     [](int socket, std::int64_t) {
       std::array<int, 9> fds;
       fds.fill(0);
       char text[] = "{}";
       iovec data{text, 2};
       alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof fds)> control{};
       msghdr header{};
       header.msg_iov = &data;
       header.msg_iovlen = 1;
       header.msg_control = control.data();
       header.msg_controllen = control.size();
       cmsghdr* part = CMSG_FIRSTHDR(&header);
       part->cmsg_level = SOL_SOCKET;
       part->cmsg_type = SCM_RIGHTS;
       part->cmsg_len = CMSG_LEN(sizeof fds);
       std::memcpy(CMSG_DATA(part), fds.data(), sizeof fds);
       (void)::sendmsg(socket, &header, MSG_NOSIGNAL);
     }},
};

class BadPeer : public ::testing::TestWithParam<Peer> {};

TEST_P(BadPeer, IsAClearFault) {
  const auto speak = GetParam().speak;
  WorkerCameraOptions options;
  options.id = "c0";
  options.limits.open = 2000ms;
  options.limits.silence = 500ms;
  options.limits.restarts = 1;
  int started = 0;
  const auto program = ThreadProgram([speak](UniqueFd socket) {
    std::array<char, 4096> buffer;
    const ssize_t n = ::recv(socket.get(), buffer.data(), buffer.size(), 0);
    if (n <= 0) return;
    const Json call = Json::parse(buffer.data(), buffer.data() + n);
    speak(socket.get(), call.at("id").get<std::int64_t>());
  });
  const auto camera = WorkerCamera::Open(options, [&] {
    ++started;
    return program();
  });
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().kind, ErrorKind::device) << ToString(camera.error());
  EXPECT_EQ(started, 2);
}

INSTANTIATE_TEST_SUITE_P(All, BadPeer, ::testing::ValuesIn(kPeers),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace scan
