#include "drivers/camera/ptp/gphoto_system.h"

#include <fmt/format.h>
#include <gphoto2/gphoto2-abilities-list.h>
#include <gphoto2/gphoto2-camera.h>
#include <gphoto2/gphoto2-context.h>
#include <gphoto2/gphoto2-port-info-list.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <type_traits>
#include <utility>

#include "drivers/camera/ptp/usb_holders.h"

namespace scan {
namespace {

namespace fs = std::filesystem;

constexpr int kTransferMs = 10'000;  // of one USB transfer; the library's own is 20 s

template <auto Free>
struct Deleter {
  template <class T>
  void operator()(T* object) const {
    (void)Free(object);
  }
};
template <class T, auto Free>
using Handle = std::unique_ptr<T, Deleter<Free>>;
using ContextHandle = std::unique_ptr<GPContext, Deleter<gp_context_unref>>;
using CameraHandle = std::unique_ptr<::Camera, Deleter<gp_camera_unref>>;
using ListHandle = Handle<CameraList, gp_list_free>;
using WidgetHandle = Handle<CameraWidget, gp_widget_free>;
using FileHandle = Handle<CameraFile, gp_file_free>;
using AbilitiesHandle = Handle<CameraAbilitiesList, gp_abilities_list_free>;
using PortsHandle = Handle<GPPortInfoList, gp_port_info_list_free>;

// The library's constructors: gp_list_new(&list).
template <class HandleType, class New>
HandleType Make(New make) {
  typename HandleType::pointer object = nullptr;
  if (make(&object) < GP_OK) return HandleType();
  return HandleType(object);
}

// What the library says of its last error, beside the code.
struct Messages {
  std::string last;
  ContextHandle context{gp_context_new()};
  Messages() {
    gp_context_set_error_func(
        context.get(),
        [](GPContext*, const char* text, void* self) {
          static_cast<Messages*>(self)->last = text ? text : "";
        },
        this);
  }
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;
};

PhotoFaultKind KindOf(int code) {
  switch (code) {
    case GP_ERROR_IO_USB_FIND:
    case GP_ERROR_UNKNOWN_PORT:
    case GP_ERROR_MODEL_NOT_FOUND:
      return PhotoFaultKind::gone;
    case GP_ERROR_IO_USB_CLAIM:
    case GP_ERROR_IO_LOCK:
      return PhotoFaultKind::claimed;
    case GP_ERROR_CAMERA_BUSY:
      return PhotoFaultKind::busy;
    case GP_ERROR_TIMEOUT:
      return PhotoFaultKind::timeout;
    case GP_ERROR_NOT_SUPPORTED:
      return PhotoFaultKind::unsupported;
    case GP_ERROR_NO_SPACE:
    case GP_ERROR_NO_MEMORY:  // also the answer of a full card
      return PhotoFaultKind::no_space;
    case GP_ERROR_IO:
    case GP_ERROR_IO_INIT:
    case GP_ERROR_IO_READ:
    case GP_ERROR_IO_WRITE:
    case GP_ERROR_IO_UPDATE:
    case GP_ERROR_IO_USB_CLEAR_HALT:
    case GP_ERROR_CORRUPTED_DATA:
      return PhotoFaultKind::transfer;
    default:
      return PhotoFaultKind::refused;
  }
}

std::string ReadWord(const fs::path& path) {
  std::string line;
  std::ifstream in(path);
  std::getline(in, line);
  return line;
}

// The kernel's node of libgphoto2's port "usb:001,005": /dev/bus/usb/001/005.
fs::path NodeOf(const PhotoDevice& device) {
  std::string place = device.handle.substr(std::min<std::size_t>(4, device.handle.size()));
  std::replace(place.begin(), place.end(), ',', '/');
  return fs::path("/dev/bus/usb") / place;
}

// Port, serial number and id as the kernel has them for bus and address of this plugging.
void Identify(PhotoDevice& device) {
  int bus = 0, address = 0;
  if (std::sscanf(device.handle.c_str(), "usb:%d,%d", &bus, &address) != 2) return;
  std::error_code error;
  for (fs::directory_iterator it("/sys/bus/usb/devices", error), end; !error && it != end;
       it.increment(error)) {
    const fs::path& path = it->path();
    if (ReadWord(path / "busnum") != std::to_string(bus) ||
        ReadWord(path / "devnum") != std::to_string(address))
      continue;
    device.port = path.filename().string();
    device.serial = ReadWord(path / "serial");
    device.usb_id = ReadWord(path / "idVendor") + ":" + ReadWord(path / "idProduct");
  }
}

std::string WidgetText(CameraWidget* widget, CameraWidgetType type) {
  switch (type) {
    case GP_WIDGET_TEXT:
    case GP_WIDGET_RADIO:
    case GP_WIDGET_MENU: {
      const char* text = nullptr;
      return gp_widget_get_value(widget, &text) >= GP_OK && text ? text : "";
    }
    case GP_WIDGET_RANGE: {
      float value = 0;
      return gp_widget_get_value(widget, &value) >= GP_OK ? fmt::format("{:g}", value) : "";
    }
    case GP_WIDGET_TOGGLE:
    case GP_WIDGET_DATE: {
      int value = 0;
      return gp_widget_get_value(widget, &value) >= GP_OK ? std::to_string(value) : "";
    }
    default:
      return "";
  }
}

// The library's code; GP_ERROR_BAD_PARAMETERS for a text that is no value of this kind.
int SetWidget(CameraWidget* widget, CameraWidgetType type, const std::string& value) {
  const auto parse = [&](auto number) {
    const auto [at, code] = std::from_chars(value.data(), value.data() + value.size(), number);
    if (code != std::errc() || at != value.data() + value.size()) return GP_ERROR_BAD_PARAMETERS;
    return gp_widget_set_value(widget, &number);
  };
  switch (type) {
    case GP_WIDGET_RANGE:
      return parse(0.0F);
    case GP_WIDGET_TOGGLE:
    case GP_WIDGET_DATE:
      return parse(0);
    case GP_WIDGET_TEXT:
    case GP_WIDGET_RADIO:
    case GP_WIDGET_MENU:
      return gp_widget_set_value(widget, value.c_str());
    default:  // a button's value is the address of a function
      return GP_ERROR_BAD_PARAMETERS;
  }
}

class GphotoCamera final : public PhotoCamera {
 public:
  GphotoCamera(PhotoDevice device, CameraHandle camera, std::unique_ptr<Messages> messages)
      : device_(std::move(device)), messages_(std::move(messages)), camera_(std::move(camera)) {}
  ~GphotoCamera() override { gp_camera_exit(camera_.get(), context()); }

  PhotoAbilities Abilities() override {
    CameraAbilities abilities{};
    if (gp_camera_get_abilities(camera_.get(), &abilities) < GP_OK) return {};
    const auto has = [&](int bit) { return (abilities.operations & bit) != 0; };
    return {has(GP_OPERATION_CAPTURE_IMAGE), has(GP_OPERATION_TRIGGER_CAPTURE),
            has(GP_OPERATION_CONFIG), (abilities.file_operations & GP_FILE_OPERATION_DELETE) != 0};
  }

  PhotoResult<std::vector<std::string>> SettingNames() override {
    const ListHandle list = Make<ListHandle>(gp_list_new);
    if (auto fault = Check(gp_camera_list_config(camera_.get(), list.get(), context()),
                           "listing the settings");
        !fault)
      return tl::unexpected(fault.error());
    return NamesOf(list.get());
  }

  PhotoResult<PhotoSetting> Get(const std::string& name) override {
    CameraWidgetType type{};
    auto widget = Widget(name, type);
    if (!widget) return tl::unexpected(widget.error());
    PhotoSetting setting{name, "", WidgetText(widget->get(), type), {}, false};
    const char* label = nullptr;
    if (gp_widget_get_label(widget->get(), &label) >= GP_OK && label) setting.label = label;
    int read_only = 0;
    if (gp_widget_get_readonly(widget->get(), &read_only) >= GP_OK)
      setting.read_only = read_only != 0;
    if (type != GP_WIDGET_RADIO && type != GP_WIDGET_MENU) return setting;
    for (int i = 0; i < gp_widget_count_choices(widget->get()); ++i) {
      const char* choice = nullptr;
      if (gp_widget_get_choice(widget->get(), i, &choice) >= GP_OK && choice)
        setting.choices.emplace_back(choice);
    }
    return setting;
  }

  PhotoStatus Set(const std::string& name, const std::string& value) override {
    CameraWidgetType type{};
    auto widget = Widget(name, type);
    if (!widget) return tl::unexpected(widget.error());
    const std::string doing = fmt::format("setting {} to '{}'", name, value);
    if (auto fault = Check(SetWidget(widget->get(), type, value), doing); !fault) return fault;
    return Check(gp_camera_set_single_config(camera_.get(), name.c_str(), widget->get(), context()),
                 doing);
  }

  PhotoStatus Trigger() override {
    return Check(gp_camera_trigger_capture(camera_.get(), context()), "releasing the shutter");
  }

  PhotoResult<PhotoFile> Capture() override {
    CameraFilePath path{};
    if (auto fault = Check(gp_camera_capture(camera_.get(), GP_CAPTURE_IMAGE, &path, context()),
                           "taking a picture");
        !fault)
      return tl::unexpected(fault.error());
    return FileOf(path);
  }

  PhotoResult<PhotoEvent> WaitEvent(int timeout_ms) override {
    CameraEventType type = GP_EVENT_UNKNOWN;
    void* raw = nullptr;
    const int code = gp_camera_wait_for_event(camera_.get(), timeout_ms, &type, &raw, context());
    const Handle<void, std::free> data(raw);
    if (auto fault = Check(code, "waiting for the camera"); !fault)
      return tl::unexpected(fault.error());
    switch (type) {
      case GP_EVENT_TIMEOUT:
        return PhotoEvent{};
      case GP_EVENT_CAPTURE_COMPLETE:
        return PhotoEvent{PhotoEventKind::capture_complete, {}, ""};
      case GP_EVENT_FILE_ADDED:
        if (data)
          return PhotoEvent{PhotoEventKind::file_added,
                            FileOf(*static_cast<const CameraFilePath*>(data.get())), ""};
        [[fallthrough]];
      default:
        return PhotoEvent{
            PhotoEventKind::other,
            {},
            type == GP_EVENT_UNKNOWN && data ? static_cast<const char*>(data.get()) : ""};
    }
  }

  PhotoResult<std::vector<std::string>> FilesIn(const std::string& folder) override {
    const ListHandle list = Make<ListHandle>(gp_list_new);
    if (auto fault =
            Check(gp_camera_folder_list_files(camera_.get(), folder.c_str(), list.get(), context()),
                  "listing " + folder);
        !fault)
      return tl::unexpected(fault.error());
    return NamesOf(list.get());
  }

  PhotoResult<std::vector<std::byte>> Download(const PhotoFile& file) override {
    const FileHandle handle = Make<FileHandle>(gp_file_new);
    const std::string doing = "fetching " + file.name;
    if (auto fault = Check(gp_camera_file_get(camera_.get(), file.folder.c_str(), file.name.c_str(),
                                              GP_FILE_TYPE_NORMAL, handle.get(), context()),
                           doing);
        !fault)
      return tl::unexpected(fault.error());
    const char* data = nullptr;
    unsigned long size = 0;
    if (auto fault = Check(gp_file_get_data_and_size(handle.get(), &data, &size), doing); !fault)
      return tl::unexpected(fault.error());
    const auto* begin = reinterpret_cast<const std::byte*>(data);
    return std::vector<std::byte>(begin, begin + size);
  }

  PhotoStatus Delete(const PhotoFile& file) override {
    return Check(
        gp_camera_file_delete(camera_.get(), file.folder.c_str(), file.name.c_str(), context()),
        "deleting " + file.name);
  }

  PhotoResult<std::vector<PhotoStorage>> Storage() override {
    CameraStorageInformation* raw = nullptr;
    int count = 0;
    const int code = gp_camera_get_storageinfo(camera_.get(), &raw, &count, context());
    const Handle<void, std::free> info(raw);
    if (auto fault = Check(code, "reading the cards"); !fault) return tl::unexpected(fault.error());
    std::vector<PhotoStorage> cards;
    for (int i = 0; i < count; ++i) {
      const CameraStorageInformation& card = raw[i];
      PhotoStorage storage;
      if (card.fields & GP_STORAGEINFO_LABEL) storage.label = card.label;
      if (card.fields & GP_STORAGEINFO_ACCESS)
        storage.writable = card.access == GP_STORAGEINFO_AC_READWRITE;
      if (card.fields & GP_STORAGEINFO_FREESPACEKBYTES)
        storage.free_kb = static_cast<std::int64_t>(card.freekbytes);
      if (card.fields & GP_STORAGEINFO_FREESPACEIMAGES)
        storage.free_images = static_cast<std::int64_t>(card.freeimages);
      cards.push_back(std::move(storage));
    }
    return cards;
  }

 private:
  GPContext* context() { return messages_->context.get(); }

  PhotoStatus Check(int code, const std::string& doing) {
    if (code >= GP_OK) {
      messages_->last.clear();
      return {};
    }
    std::string what = fmt::format("{} failed: {}", doing, gp_result_as_string(code));
    if (!messages_->last.empty()) what += " (" + messages_->last + ")";
    messages_->last.clear();
    std::error_code error;
    const bool there = fs::exists(NodeOf(device_), error);
    return tl::unexpected(PhotoFault{there ? KindOf(code) : PhotoFaultKind::gone, std::move(what)});
  }

  static PhotoFile FileOf(const CameraFilePath& path) {
    return {{path.folder, strnlen(path.folder, sizeof(path.folder))},
            {path.name, strnlen(path.name, sizeof(path.name))}};
  }

  static std::vector<std::string> NamesOf(CameraList* list) {
    std::vector<std::string> names;
    for (int i = 0; i < gp_list_count(list); ++i) {
      const char* name = nullptr;
      if (gp_list_get_name(list, i, &name) >= GP_OK && name) names.emplace_back(name);
    }
    return names;
  }

  PhotoResult<WidgetHandle> Widget(const std::string& name, CameraWidgetType& type) {
    CameraWidget* raw = nullptr;
    const int code = gp_camera_get_single_config(camera_.get(), name.c_str(), &raw, context());
    WidgetHandle widget(raw);
    if (auto fault = Check(code, "reading " + name); !fault) return tl::unexpected(fault.error());
    if (auto fault = Check(gp_widget_get_type(widget.get(), &type), "reading " + name); !fault)
      return tl::unexpected(fault.error());
    return widget;
  }

  PhotoDevice device_;
  std::unique_ptr<Messages> messages_;
  CameraHandle camera_;
};

class GphotoSystem final : public PhotoSystem {
 public:
  explicit GphotoSystem(AbilitiesHandle abilities) : abilities_(std::move(abilities)) {}

  PhotoResult<std::vector<PhotoDevice>> List() override {
    if (auto loaded = LoadPorts(); !loaded) return tl::unexpected(loaded.error());
    Messages messages;
    const ListHandle list = Make<ListHandle>(gp_list_new);
    const int code = gp_abilities_list_detect(abilities_.get(), ports_.get(), list.get(),
                                              messages.context.get());
    if (code < GP_OK)
      return tl::unexpected(PhotoFault{
          KindOf(code), fmt::format("looking for cameras failed: {}", gp_result_as_string(code))});
    std::vector<PhotoDevice> devices;
    for (int i = 0; i < gp_list_count(list.get()); ++i) {
      const char* model = nullptr;
      const char* port = nullptr;
      gp_list_get_name(list.get(), i, &model);
      gp_list_get_value(list.get(), i, &port);
      if (!model || !port || std::strncmp(port, "usb:", 4) != 0) continue;
      PhotoDevice device{model, "", "", "", port};
      Identify(device);
      devices.push_back(std::move(device));
    }
    std::sort(devices.begin(), devices.end(),
              [](const PhotoDevice& a, const PhotoDevice& b) { return a.port < b.port; });
    return devices;
  }

  PhotoResult<std::unique_ptr<PhotoCamera>> Open(const PhotoDevice& device) override {
    if (auto loaded = LoadPorts(); !loaded) return tl::unexpected(loaded.error());
    if (access(NodeOf(device).c_str(), F_OK) == 0 &&
        access(NodeOf(device).c_str(), R_OK | W_OK) != 0)
      return tl::unexpected(
          PhotoFault{PhotoFaultKind::not_permitted, "this user may not open the camera"});
    auto messages = std::make_unique<Messages>();
    CameraHandle camera = Make<CameraHandle>(gp_camera_new);
    CameraAbilities abilities{};
    GPPortInfo port{};
    int code = gp_abilities_list_lookup_model(abilities_.get(), device.model.c_str());
    if (code >= GP_OK) code = gp_abilities_list_get_abilities(abilities_.get(), code, &abilities);
    if (code >= GP_OK) code = gp_camera_set_abilities(camera.get(), abilities);
    if (code >= GP_OK) code = gp_port_info_list_lookup_path(ports_.get(), device.handle.c_str());
    if (code >= GP_OK) code = gp_port_info_list_get_info(ports_.get(), code, &port);
    if (code >= GP_OK) code = gp_camera_set_port_info(camera.get(), port);
    if (code >= GP_OK) code = gp_camera_init(camera.get(), messages->context.get());
    if (code < GP_OK) {
      std::string what = fmt::format("opening the camera failed: {}", gp_result_as_string(code));
      if (!messages->last.empty()) what += " (" + messages->last + ")";
      return tl::unexpected(PhotoFault{KindOf(code), std::move(what)});
    }
    gp_port_set_timeout(camera->port, kTransferMs);
    return std::make_unique<GphotoCamera>(device, std::move(camera), std::move(messages));
  }

  std::vector<std::string> Competitors(const PhotoDevice& device) override {
    return ProgramsTakingCamera(NodeOf(device));
  }

 private:
  // Anew each time: bus and address change with every plugging.
  PhotoStatus LoadPorts() {
    ports_ = Make<PortsHandle>(gp_port_info_list_new);
    if (const int code = gp_port_info_list_load(ports_.get()); code < GP_OK)
      return tl::unexpected(
          PhotoFault{PhotoFaultKind::refused,
                     fmt::format("libgphoto2 has no USB access: {}", gp_result_as_string(code))});
    return {};
  }

  AbilitiesHandle abilities_;
  PortsHandle ports_;
};

}  // namespace

PhotoResult<std::unique_ptr<PhotoSystem>> MakeGphotoSystem() {
  Messages messages;
  AbilitiesHandle abilities = Make<AbilitiesHandle>(gp_abilities_list_new);
  const int code = gp_abilities_list_load(abilities.get(), messages.context.get());
  if (code < GP_OK || gp_abilities_list_count(abilities.get()) <= 0)
    return tl::unexpected(PhotoFault{PhotoFaultKind::refused,
                                     fmt::format("libgphoto2 has no camera drivers: {}; install "
                                                 "libgphoto2-6",
                                                 gp_result_as_string(code))});
  return std::make_unique<GphotoSystem>(std::move(abilities));
}

}  // namespace scan
