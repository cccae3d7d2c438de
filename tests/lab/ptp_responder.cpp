#include "tests/lab/ptp_responder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/functionfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <span>
#include <thread>

#include "drivers/base/unique_fd.h"

namespace scan {

// One property with the values that it may take; `size` bytes each.
struct PtpProperty {
  std::uint16_t type;  // 2 UINT8, 4 UINT16, 6 UINT32
  std::size_t size;
  std::vector<std::uint64_t> choices;  // empty: read only, 0 to 100
  std::uint64_t value;
};

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint16_t kOk = 0x2001, kNotSupported = 0x2005, kBadHandle = 0x2009,
                        kBadProperty = 0x200a, kBadValue = 0x201c;
constexpr std::uint32_t kStorage = 0x00010001;
constexpr std::uint16_t kJpeg = 0x3801;

// Little-endian, as everything in PTP.
template <class T>
void Put(Bytes& out, T value) {
  for (std::size_t k = 0; k < sizeof(T); ++k)
    out.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * k)));
}
template <class T>
void PutArray(Bytes& out, std::initializer_list<T> values) {
  Put(out, static_cast<std::uint32_t>(values.size()));
  for (const T value : values) Put(out, value);
}
void PutText(Bytes& out, std::string_view text) {
  Put(out, static_cast<std::uint8_t>(text.empty() ? 0 : text.size() + 1));
  for (const char c : text) Put(out, static_cast<std::uint16_t>(c));
  if (!text.empty()) Put(out, std::uint16_t{0});
}
std::uint64_t Take(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < size && at + k < bytes.size(); ++k)
    value |= static_cast<std::uint64_t>(bytes[at + k]) << (8 * k);
  return value;
}

// Still image class, bulk in and out, interrupt in; full and high speed.
Bytes Descriptors() {
  Bytes speeds;
  for (const std::uint16_t packet : {std::uint16_t{64}, std::uint16_t{512}}) {
    const Bytes interface { 9, USB_DT_INTERFACE, 0, 0, 3, 6, 1, 1, 0 };
    speeds.insert(speeds.end(), interface.begin(), interface.end());
    for (const auto& [address, type, size] :
         {std::tuple(0x81, 2, packet), {0x02, 2, packet}, {0x83, 3, std::uint16_t{64}}}) {
      for (const int field :
           {7, USB_DT_ENDPOINT, address, type, size & 0xff, size >> 8, type == 3 ? 4 : 0})
        speeds.push_back(static_cast<std::uint8_t>(field));
    }
  }
  Bytes out;
  Put(out, std::uint32_t{FUNCTIONFS_DESCRIPTORS_MAGIC_V2});
  Put(out, static_cast<std::uint32_t>(20 + speeds.size()));
  Put(out, std::uint32_t{FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC});
  Put(out, std::uint32_t{4});
  Put(out, std::uint32_t{4});
  out.insert(out.end(), speeds.begin(), speeds.end());
  return out;
}

Bytes Strings() {
  Bytes out;
  for (const std::uint32_t word : {std::uint32_t{FUNCTIONFS_STRINGS_MAGIC}, 16U, 0U, 0U})
    Put(out, word);
  return out;
}

bool WriteAll(int fd, const Bytes& bytes) {
  return write(fd, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
}

constexpr std::uint16_t kBattery = 0x5001, kExposureTime = 0x500d, kProgram = 0x500e,
                        kSpeed = 0x500f;

std::map<std::uint16_t, PtpProperty> Properties() {
  return {{kBattery, {2, 1, {}, 80}},
          {kExposureTime, {6, 4, {10, 40, 80, 100, 166, 10'000}, 80}},  // tenths of milliseconds
          {kProgram, {4, 2, {1, 2}, 1}},                                // M, P
          {kSpeed, {4, 2, {100, 200, 400}, 100}}};
}

struct Container {
  std::uint16_t type = 0, code = 0;
  std::uint32_t transaction = 0;
  Bytes body;
  std::uint32_t parameter(std::size_t k) const {
    return static_cast<std::uint32_t>(Take(body, 4 * k, 4));
  }
};

}  // namespace

class PtpResponder::Impl {
 public:
  Impl(const std::string& folder, PtpPainter painter)
      : painter_(std::move(painter)), ep0_(open((folder + "/ep0").c_str(), O_RDWR | O_CLOEXEC)) {
    described_ = ep0_ && WriteAll(ep0_.get(), Descriptors()) && WriteAll(ep0_.get(), Strings());
    if (!described_) return;
    const auto endpoint = [&](int number) {
      return UniqueFd(open(fmt::format("{}/ep{}", folder, number).c_str(), O_RDWR | O_CLOEXEC));
    };
    in_ = endpoint(1);
    out_ = endpoint(2);
    events_ = endpoint(3);
    std::thread([this] { AnswerControl(); }).detach();
    std::thread([this] { SendEvents(); }).detach();
  }

  bool good() const { return described_ && in_ && out_ && events_; }

  [[noreturn]] void Run() {
    for (;;) {
      Container command;
      if (Receive(command) && command.type == 1) Answer(command);
    }
  }

 private:
  // Class requests of the still image class: cancel, reset, status.
  void AnswerControl() {
    for (;;) {
      usb_functionfs_event event{};
      if (read(ep0_.get(), &event, sizeof(event)) < static_cast<ssize_t>(sizeof(event))) continue;
      if (event.type == FUNCTIONFS_UNBIND || event.type == FUNCTIONFS_DISABLE) {
        const std::lock_guard lock(mutex_);
        queue_.clear();
      }
      if (event.type != FUNCTIONFS_SETUP) continue;
      const usb_ctrlrequest& setup = event.u.setup;
      Bytes data(setup.wLength);
      [[maybe_unused]] ssize_t done = 0;
      if (setup.bRequestType & USB_DIR_IN) {
        Bytes status;
        Put(status, std::uint16_t{4});
        Put(status, kOk);
        done = write(ep0_.get(), status.data(), std::min(status.size(), data.size()));
      } else {
        done = read(ep0_.get(), data.data(), data.size());
      }
    }
  }

  // The interrupt endpoint waits for the host, so it has a thread of its own.
  void SendEvents() {
    for (;;) {
      Bytes event;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !queue_.empty(); });
        event = std::move(queue_.front());
        queue_.pop_front();
      }
      WriteAll(events_.get(), event);
    }
  }

  void Queue(std::uint16_t code, std::uint32_t transaction, std::uint32_t parameter) {
    Bytes event = Header(16, 4, code, transaction);
    Put(event, parameter);
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(event));
    changed_.notify_one();
  }

  static Bytes Header(std::size_t length, std::uint16_t type, std::uint16_t code,
                      std::uint32_t transaction) {
    Bytes out;
    Put(out, static_cast<std::uint32_t>(length));
    Put(out, type);
    Put(out, code);
    Put(out, transaction);
    return out;
  }

  bool Receive(Container& container) {
    std::array<std::uint8_t, 512> packet{};
    const ssize_t got = read(out_.get(), packet.data(), packet.size());
    if (got < 12) {  // unplugged, or a stray packet
      if (got < 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
      return false;
    }
    const std::span<const std::uint8_t> bytes(packet.data(), static_cast<std::size_t>(got));
    container.type = static_cast<std::uint16_t>(Take(bytes, 4, 2));
    container.code = static_cast<std::uint16_t>(Take(bytes, 6, 2));
    container.transaction = static_cast<std::uint32_t>(Take(bytes, 8, 4));
    container.body.assign(bytes.begin() + 12, bytes.end());
    return true;
  }

  void Send(std::uint16_t type, std::uint16_t code, std::uint32_t transaction, const Bytes& body) {
    Bytes out = Header(12 + body.size(), type, code, transaction);
    out.insert(out.end(), body.begin(), body.end());
    WriteAll(in_.get(), out);
    if (type == 2 && out.size() % 512 == 0) (void)!write(in_.get(), nullptr, 0);  // ends it
  }

  void Answer(const Container& command) {
    Bytes data, parameters;
    bool has_data = true;
    std::uint16_t result = kOk;
    switch (command.code) {
      case 0x1001:
        data = DeviceInfo();
        break;
      case 0x1004:
        PutArray(data, {kStorage});
        break;
      case 0x1005:
        data = StorageInfo();
        break;
      case 0x1007:
        Put(data, static_cast<std::uint32_t>(objects_.size()));
        for (const auto& [handle, object] : objects_) Put(data, handle);
        break;
      case 0x1008:
      case 0x1009:
        if (const auto found = objects_.find(command.parameter(0)); found == objects_.end()) {
          result = kBadHandle;
        } else {
          data = command.code == 0x1009 ? found->second : ObjectInfo(found->first);
        }
        break;
      case 0x1014:
      case 0x1015:
        if (const auto found = properties_.find(static_cast<std::uint16_t>(command.parameter(0)));
            found == properties_.end()) {
          result = kBadProperty;
        } else if (command.code == 0x1014) {
          data = Describe(found->first, found->second);
        } else {
          PutValue(data, found->second, found->second.value);
        }
        break;
      default:
        has_data = false;
        result = AnswerWithoutData(command, parameters);
    }
    if (has_data && result == kOk) Send(2, command.code, command.transaction, data);
    Send(3, result, command.transaction, parameters);
    if (command.code == 0x100e && result == kOk) Expose(command.transaction);
  }

  std::uint16_t AnswerWithoutData(const Container& command, Bytes& parameters) {
    switch (command.code) {
      case 0x1002:  // open and close a session
      case 0x1003:
      case 0x100e:  // initiate capture: the answer comes first
        return kOk;
      case 0x1006:
        Put(parameters, static_cast<std::uint32_t>(objects_.size()));
        return kOk;
      case 0x100b:
        if (command.parameter(0) == 0xffffffff) objects_.clear();
        return command.parameter(0) == 0xffffffff || objects_.erase(command.parameter(0)) > 0
                   ? kOk
                   : kBadHandle;
      case 0x1016:
        return SetProperty(static_cast<std::uint16_t>(command.parameter(0)));
      default:
        return kNotSupported;
    }
  }

  std::uint16_t SetProperty(std::uint16_t code) {
    Container data;
    while (!Receive(data)) {
    }
    if (data.type != 2) return kBadValue;  // unplugged before it came
    const auto found = properties_.find(code);
    if (found == properties_.end()) return kBadProperty;
    PtpProperty& property = found->second;
    const std::uint64_t value = Take(data.body, 0, property.size);
    if (std::find(property.choices.begin(), property.choices.end(), value) ==
        property.choices.end())
      return kBadValue;
    property.value = value;
    return kOk;
  }

  void Expose(std::uint32_t transaction) {
    const double exposure_us = 100.0 * static_cast<double>(properties_.at(kExposureTime).value);
    std::this_thread::sleep_for(std::chrono::microseconds(static_cast<std::int64_t>(exposure_us)));
    Bytes picture = painter_({next_, exposure_us});
    if (!picture.empty()) {
      objects_[next_] = std::move(picture);
      Queue(0x4002, transaction, next_);  // object added
      ++next_;
    }
    Queue(0x400d, transaction, transaction);  // capture complete
  }

  static Bytes DeviceInfo() {
    Bytes out;
    Put(out, std::uint16_t{100});
    Put(out, std::uint32_t{0});
    Put(out, std::uint16_t{100});
    PutText(out, "");
    Put(out, std::uint16_t{0});
    PutArray<std::uint16_t>(out, {0x1001, 0x1002, 0x1003, 0x1004, 0x1005, 0x1006, 0x1007, 0x1008,
                                  0x1009, 0x100b, 0x100e, 0x1014, 0x1015, 0x1016});
    PutArray<std::uint16_t>(out, {0x4002, 0x400d});
    PutArray<std::uint16_t>(out, {kBattery, kExposureTime, kProgram, kSpeed});
    PutArray<std::uint16_t>(out, {kJpeg});
    PutArray<std::uint16_t>(out, {kJpeg});
    for (const char* text : {"Lab", "Lab PTP Camera", "1.0", "LAB0002"}) PutText(out, text);
    return out;
  }

  static Bytes StorageInfo() {
    Bytes out;
    Put(out, std::uint16_t{4});  // removable RAM
    Put(out, std::uint16_t{2});  // flat
    Put(out, std::uint16_t{0});  // read and write
    Put(out, std::uint64_t{1} << 30);
    Put(out, std::uint64_t{1} << 29);
    Put(out, std::uint32_t{500});
    PutText(out, "card");
    PutText(out, "LAB");
    return out;
  }

  Bytes ObjectInfo(std::uint32_t handle) const {
    Bytes out;
    Put(out, kStorage);
    Put(out, kJpeg);
    Put(out, std::uint16_t{0});
    Put(out, static_cast<std::uint32_t>(objects_.at(handle).size()));
    Put(out, std::uint16_t{0});  // no thumbnail: format, size, width, height
    for (int k = 0; k < 3; ++k) Put(out, std::uint32_t{0});
    for (int k = 0; k < 3; ++k) Put(out, std::uint32_t{0});  // width, height, depth: in the file
    Put(out, std::uint32_t{0});                              // at the top
    Put(out, std::uint16_t{0});
    Put(out, std::uint32_t{0});
    Put(out, handle);
    PutText(out, fmt::format("LAB_{:04}.JPG", handle));
    PutText(out, "20260101T000000");
    PutText(out, "20260101T000000");
    PutText(out, "");
    return out;
  }

  static void PutValue(Bytes& out, const PtpProperty& property, std::uint64_t value) {
    for (std::size_t k = 0; k < property.size; ++k)
      out.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
  }

  static Bytes Describe(std::uint16_t code, const PtpProperty& property) {
    Bytes out;
    Put(out, code);
    Put(out, property.type);
    Put(out, static_cast<std::uint8_t>(property.choices.empty() ? 0 : 1));
    PutValue(out, property, property.value);
    PutValue(out, property, property.value);
    if (property.choices.empty()) {
      Put(out, std::uint8_t{1});  // a range
      for (const std::uint64_t bound : {0, 100, 1}) PutValue(out, property, bound);
      return out;
    }
    Put(out, std::uint8_t{2});  // an enumeration
    Put(out, static_cast<std::uint16_t>(property.choices.size()));
    for (const std::uint64_t choice : property.choices) PutValue(out, property, choice);
    return out;
  }

  PtpPainter painter_;
  UniqueFd ep0_, in_, out_, events_;
  bool described_ = false;
  std::map<std::uint16_t, PtpProperty> properties_ = Properties();
  std::map<std::uint32_t, Bytes> objects_;
  std::uint32_t next_ = 1;
  std::mutex mutex_;  // of queue_
  std::condition_variable changed_;
  std::deque<Bytes> queue_;
};

PtpResponder::PtpResponder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PtpResponder::~PtpResponder() = default;

Result<std::unique_ptr<PtpResponder>> PtpResponder::Open(const std::string& folder,
                                                         PtpPainter painter) {
  auto impl = std::make_unique<Impl>(folder, std::move(painter));
  if (!impl->good())
    return DeviceFault(std::strerror(errno), folder, "mount FunctionFS there (guest/ptp.sh)");
  return std::unique_ptr<PtpResponder>(new PtpResponder(std::move(impl)));
}

void PtpResponder::Run() { impl_->Run(); }

}  // namespace scan
