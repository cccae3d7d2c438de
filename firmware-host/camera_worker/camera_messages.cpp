#include "firmware-host/camera_worker/camera_messages.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string_view>

namespace scan {
namespace {

using Json = nlohmann::json;

constexpr char kMend[] = "use programs of the same version; if it comes again, report it";
constexpr int kSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE | F_SEAL_SEAL;
constexpr std::array<std::string_view, 7> kExtensions = {"jpg", "png", "tif", "dng",
                                                         "nef", "cr2", "arw"};
constexpr std::array<std::pair<ExposureSource, std::string_view>, 4> kSources = {
    {{ExposureSource::sensor, "sensor"},
     {ExposureSource::trigger, "trigger"},
     {ExposureSource::hot_shoe, "hot_shoe"},
     {ExposureSource::ptp_bound, "ptp_bound"}}};
constexpr int kMaxSide = 1 << 16;
constexpr std::size_t kMaxText = 4096;
constexpr std::size_t kMaxListed = 64;

tl::unexpected<Error> Malformed(const std::string& what, const char* message) {
  return BadInput("malformed message (" + what + ")", message, kMend);
}

// The one place where nlohmann's exceptions become a Result.
template <class T, class Read>
Result<T> Guarded(const char* message, const Json& json, Read read) {
  try {
    return read(json);
  } catch (const Json::exception& e) {
    return Malformed(e.what(), message);
  }
}

Json OptionalNumbers(const std::optional<double>& exposure_us, const std::optional<double>& gain) {
  Json json = Json::object();
  if (exposure_us) json["exposure_us"] = *exposure_us;
  if (gain) json["gain"] = *gain;
  return json;
}

std::optional<double> NumberIn(const Json& json, const char* key) {
  if (!json.contains(key)) return {};
  if (!json[key].is_number() && !json[key].is_null())
    throw Json::type_error::create(302, std::string(key) + " is no number", &json);
  // JSON has no NaN: what was none arrives as null, and is refused as out of range by the camera.
  return json[key].is_null() ? std::nan("") : json[key].get<double>();
}

std::string TextIn(const Json& json, const char* key) {
  auto text = json.at(key).get<std::string>();
  if (text.size() > kMaxText) throw Json::other_error::create(501, "a text is too long", &json);
  return text;
}

// A fraction would be cut off, and one that is out of range be anything.
std::int64_t WholeIn(const Json& json, const char* key) {
  const Json& number = json.at(key);
  if (!number.is_number_integer())
    throw Json::type_error::create(302, std::string(key) + " is no whole number", &json);
  return number.get<std::int64_t>();
}

std::uint64_t CountIn(const Json& json, const char* key) {
  const Json& number = json.at(key);
  if (!number.is_number_integer() || (!number.is_number_unsigned() && number < 0))
    throw Json::type_error::create(302, std::string(key) + " is no count", &json);
  return number.get<std::uint64_t>();
}

Result<UniqueFd> MemoryFile(const std::vector<std::byte>& bytes) {
  UniqueFd fd(::memfd_create("scanstation-frame", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  const auto failed = [](const char* what) {
    return Failed(fmt::format("{} ({})", what, std::strerror(errno)), "frame",
                  "close other programs: there is too little memory");
  };
  if (!fd) return failed("cannot make a memory file");
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t n = ::write(fd.get(), bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return failed("cannot fill a memory file");
    done += static_cast<std::size_t>(n);
  }
  if (::fcntl(fd.get(), F_ADD_SEALS, kSeals) != 0) return failed("cannot seal a memory file");
  return fd;
}

Result<std::vector<std::byte>> ReadMemoryFile(const UniqueFd& fd, std::uint64_t bytes) {
  const int seals = ::fcntl(fd.get(), F_GET_SEALS);  // fails for all but memory files
  if (seals < 0 || (seals & kSeals) != kSeals) return Malformed("no sealed memory file", "grab");
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0 || static_cast<std::uint64_t>(info.st_size) != bytes)
    return Malformed(fmt::format("a file of {} bytes where {} are stated", info.st_size, bytes),
                     "grab");
  std::vector<std::byte> content(bytes);
  for (std::size_t done = 0; done < content.size();) {
    const ssize_t n =
        ::pread(fd.get(), content.data() + done, content.size() - done, static_cast<off_t>(done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return Malformed("a memory file cannot be read", "grab");
    done += static_cast<std::size_t>(n);
  }
  return content;
}

Result<ExposureBound> BoundFromJson(const Json& json) {
  ExposureBound bound;
  bound.not_before_ns = WholeIn(json, "not_before_ns");
  bound.not_after_ns = WholeIn(json, "not_after_ns");
  const auto name = json.at("source").get<std::string>();
  const auto source = std::find_if(kSources.begin(), kSources.end(),
                                   [&](const auto& entry) { return entry.second == name; });
  if (source == kSources.end()) return Malformed("an unknown source of the exposure", "grab");
  bound.source = source->first;
  if (bound.not_after_ns < bound.not_before_ns)
    return Malformed("an exposure that ends before it begins", "grab");
  return bound;
}

}  // namespace

Json ToJson(const CameraInfo& info) {
  return {{"id", info.id}, {"model", info.model}, {"w", info.w}, {"h", info.h}};
}
Json ToJson(const CameraSettings& settings) {
  return OptionalNumbers(settings.exposure_us, settings.gain);
}
Json ToJson(const AppliedSettings& applied) {
  return OptionalNumbers(applied.exposure_us, applied.gain);
}
Json ToJson(const std::vector<CameraListing>& cameras) {
  Json list = Json::array();
  for (const CameraListing& camera : cameras)
    list.push_back({{"id", camera.id}, {"model", camera.model}, {"details", camera.details}});
  return {{"cameras", list}};
}

Result<CameraInfo> CameraInfoFromJson(const Json& json) {
  return Guarded<CameraInfo>("open", json, [](const Json& j) -> Result<CameraInfo> {
    const std::int64_t w = WholeIn(j, "w"), h = WholeIn(j, "h");
    if (w < 1 || h < 1 || w > kMaxSide || h > kMaxSide)
      return Malformed(fmt::format("a picture of {} x {}", w, h), "open");
    return CameraInfo{TextIn(j, "id"), TextIn(j, "model"), static_cast<int>(w),
                      static_cast<int>(h)};
  });
}

Result<CameraSettings> CameraSettingsFromJson(const Json& json) {
  return Guarded<CameraSettings>("configure", json, [](const Json& j) {
    return CameraSettings{NumberIn(j, "exposure_us"), NumberIn(j, "gain")};
  });
}

Result<AppliedSettings> AppliedSettingsFromJson(const Json& json) {
  return Guarded<AppliedSettings>("configure", json, [](const Json& j) -> Result<AppliedSettings> {
    const AppliedSettings applied{NumberIn(j, "exposure_us"), NumberIn(j, "gain")};
    for (const auto& value : {applied.exposure_us, applied.gain})
      if (value && !(std::isfinite(*value) && *value >= 0))
        return Malformed("a setting that is no number", "applied");
    return applied;
  });
}

Result<std::vector<CameraListing>> CameraListingsFromJson(const Json& json) {
  using Listings = std::vector<CameraListing>;
  return Guarded<Listings>("list", json, [](const Json& j) -> Result<Listings> {
    Listings cameras;
    const Json& list = j.at("cameras");
    if (!list.is_array() || list.size() > kMaxListed) return Malformed("no list", "list");
    for (const Json& entry : list) {
      cameras.push_back({TextIn(entry, "id"), TextIn(entry, "model"), {}});
      cameras.back().details = entry.at("details").get<std::vector<std::string>>();
    }
    return cameras;
  });
}

Result<WorkerMessage> PackFrame(const Frame& frame) {
  if (frame.files.size() > kMaxWorkerFiles)
    return Failed(fmt::format("a frame of {} files", frame.files.size()), "frame",
                  fmt::format("a worker can send {} at most", kMaxWorkerFiles));
  WorkerMessage message;
  Json files = Json::array();
  for (const EncodedFile& file : frame.files) {
    SCAN_TRY(UniqueFd fd, MemoryFile(file.bytes));
    files.push_back({{"extension", file.extension}, {"bytes", file.bytes.size()}});
    message.files.push_back(std::move(fd));
  }
  std::string_view source;
  for (const auto& [value, name] : kSources)
    if (value == frame.exposure.source) source = name;
  message.body = {{"files", files},
                  {"sensor_sequence", frame.sensor_sequence},
                  {"exposure",
                   {{"not_before_ns", frame.exposure.not_before_ns},
                    {"not_after_ns", frame.exposure.not_after_ns},
                    {"source", source}}},
                  {"applied", ToJson(frame.applied)}};
  return message;
}

Result<Frame> UnpackFrame(const Json& body, const std::vector<UniqueFd>& files,
                          std::uint64_t max_bytes) {
  return Guarded<Frame>("grab", body, [&](const Json& j) -> Result<Frame> {
    const Json& stated = j.at("files");
    if (!stated.is_array() || stated.empty() || stated.size() != files.size())
      return Malformed("files and descriptors do not match", "grab");
    Frame frame;
    frame.sensor_sequence = CountIn(j, "sensor_sequence");
    SCAN_TRY(frame.exposure, BoundFromJson(j.at("exposure")));
    SCAN_TRY(frame.applied, AppliedSettingsFromJson(j.at("applied")));
    for (std::size_t i = 0; i < files.size(); ++i) {
      const auto extension = stated[i].at("extension").get<std::string>();
      const std::uint64_t bytes = CountIn(stated[i], "bytes");
      if (std::find(kExtensions.begin(), kExtensions.end(), extension) == kExtensions.end())
        return Malformed("an unknown kind of picture file", "grab");
      if (bytes == 0 || bytes > max_bytes)
        return Malformed(fmt::format("a picture of {} bytes", bytes), "grab");
      SCAN_TRY(auto content, ReadMemoryFile(files[i], bytes));
      frame.files.push_back({extension, std::move(content)});
    }
    return frame;
  });
}

}  // namespace scan
