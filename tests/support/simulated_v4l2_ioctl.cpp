// What the simulated driver answers to each ioctl.
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <tuple>

#include "drivers/camera/v4l2/pixel_format.h"
#include "tests/support/simulated_v4l2.h"

namespace scan {
namespace {

void CopyText(const std::string& text, void* field, std::size_t size) {
  std::memset(field, 0, size);
  std::memcpy(field, text.data(), std::min(text.size(), size - 1));
}

}  // namespace

const SimulatedFormat* SimulatedV4l2::FormatOf(std::uint32_t fourcc) const {
  const auto found = std::find_if(options_.formats.begin(), options_.formats.end(),
                                  [&](const SimulatedFormat& f) { return f.fourcc == fourcc; });
  return found == options_.formats.end() ? nullptr : &*found;
}

void SimulatedV4l2::SetPix(v4l2_pix_format& pix) {
  const PixelFormat* known = FindPixelFormat(fourcc_);
  pix = {};
  pix.width = static_cast<std::uint32_t>(w_);
  pix.height = static_cast<std::uint32_t>(h_);
  pix.pixelformat = fourcc_;
  pix.field = V4L2_FIELD_NONE;
  pix.colorspace = options_.colorspace;
  pix.ycbcr_enc = options_.ycbcr_enc;
  pix.quantization = options_.quantization;
  const int line = MinBytesPerLine(*known, w_);
  pix.bytesperline = line > 0 ? static_cast<std::uint32_t>(line + options_.line_padding) : 0;
  const std::size_t plain = PictureBytes(*known, w_, h_, static_cast<int>(pix.bytesperline));
  pix.sizeimage = static_cast<std::uint32_t>((plain > 0 ? plain : 4 * w_ * h_ + 2048) + 4096);
}

int SimulatedV4l2::SetFormat(v4l2_format& format) {
  if (!buffers_.empty()) return -EBUSY;
  const v4l2_pix_format& asked = format.fmt.pix;
  const SimulatedFormat* found = FormatOf(asked.pixelformat);
  if (!found) found = &options_.formats.front();
  fourcc_ = found->fourcc;
  const std::pair<int, int> size{static_cast<int>(asked.width), static_cast<int>(asked.height)};
  const bool has = found->stepwise || std::count(found->sizes.begin(), found->sizes.end(), size);
  std::tie(w_, h_) = has ? size : found->sizes.front();
  SetPix(format.fmt.pix);
  return 0;
}

void SimulatedV4l2::ChangeFormat(int w, int h) {
  w_ = w;
  h_ = h;
}

int SimulatedV4l2::ListSizes(v4l2_frmsizeenum& entry) const {
  const SimulatedFormat* format = FormatOf(entry.pixel_format);
  if (!format) return -EINVAL;
  if (format->stepwise) {
    if (entry.index > 0) return -EINVAL;
    entry.type = V4L2_FRMSIZE_TYPE_STEPWISE;
    entry.stepwise = {16, static_cast<std::uint32_t>(format->sizes.front().first),  2,
                      16, static_cast<std::uint32_t>(format->sizes.front().second), 2};
    return 0;
  }
  if (entry.index >= format->sizes.size()) return -EINVAL;
  entry.type = V4L2_FRMSIZE_TYPE_DISCRETE;
  entry.discrete.width = static_cast<std::uint32_t>(format->sizes[entry.index].first);
  entry.discrete.height = static_cast<std::uint32_t>(format->sizes[entry.index].second);
  return 0;
}

int SimulatedV4l2::QueryControl(v4l2_query_ext_ctrl& query) {
  const std::uint32_t after = query.id & V4L2_CTRL_ID_MASK;
  const auto next = std::find_if(options_.controls.begin(), options_.controls.end(),
                                 [&](const SimulatedControl& c) { return c.id > after; });
  if (!(query.id & V4L2_CTRL_FLAG_NEXT_CTRL) || next == options_.controls.end()) return -EINVAL;
  query = {};
  query.id = next->id;
  query.type = next->type;
  CopyText(next->title, query.name, sizeof(query.name));
  query.minimum = next->min;
  query.maximum = next->max;
  query.step = 1;
  query.default_value = next->value;
  query.flags = next->flags;
  if (next->writable_while &&
      control(next->writable_while->first).value != next->writable_while->second)
    query.flags |= V4L2_CTRL_FLAG_INACTIVE;
  return 0;
}

int SimulatedV4l2::QueryMenu(v4l2_querymenu& query) {
  const SimulatedControl& of = control(query.id);
  const auto entry = of.menu.find(query.index);
  if (entry == of.menu.end()) return -EINVAL;
  if (of.type == V4L2_CTRL_TYPE_INTEGER_MENU)
    query.value = std::stoll(entry->second);
  else
    CopyText(entry->second, query.name, sizeof(query.name));
  return 0;
}

int SimulatedV4l2::AccessControl(v4l2_ext_controls& controls, bool set) {
  v4l2_ext_control& field = controls.controls[0];
  const std::uint32_t id = field.id;
  const auto found = std::find_if(options_.controls.begin(), options_.controls.end(),
                                  [&](const SimulatedControl& c) { return c.id == id; });
  if (found == options_.controls.end()) return -EINVAL;
  if (!set) {
    field.value = static_cast<std::int32_t>(found->value);
    return 0;
  }
  if (found->writable_while &&
      control(found->writable_while->first).value != found->writable_while->second)
    return -EACCES;
  const std::int64_t value = field.value;
  if (value < found->min || value > found->max) return -ERANGE;
  found->value = value - value % found->made_multiple_of;
  return 0;
}

int SimulatedV4l2::RequestBuffers(v4l2_requestbuffers& request) {
  if (!mappings_.empty()) return -EBUSY;  // as kernels before 4.20 do
  buffers_.clear();
  if (request.count == 0) return StreamOn(false);
  v4l2_pix_format pix{};
  SetPix(pix);
  for (std::uint32_t i = 0; i < request.count; ++i) {
    buffers_.push_back(std::make_unique<Buffer>());
    buffers_.back()->memory = std::make_shared<std::vector<std::byte>>(pix.sizeimage);
  }
  return 0;
}

int SimulatedV4l2::Dequeue(v4l2_buffer& buffer) {
  if (!streaming_) return -EINVAL;
  if (done_.empty()) return -EAGAIN;
  buffer = buffers_[done_.front()]->done;
  done_.pop_front();
  return 0;
}

int SimulatedV4l2::Dispatch(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& capability = *static_cast<v4l2_capability*>(argument);
      CopyText("simvideo", capability.driver, sizeof(capability.driver));
      CopyText(options_.name, capability.card, sizeof(capability.card));
      capability.device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
      capability.capabilities = capability.device_caps | V4L2_CAP_DEVICE_CAPS;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      auto& entry = *static_cast<v4l2_fmtdesc*>(argument);
      if (entry.index >= options_.formats.size()) return -EINVAL;
      entry.pixelformat = options_.formats[entry.index].fourcc;
      return 0;
    }
    case VIDIOC_ENUM_FRAMESIZES:
      return ListSizes(*static_cast<v4l2_frmsizeenum*>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS: {
      auto& entry = *static_cast<v4l2_frmivalenum*>(argument);
      if (entry.index > 0) return -EINVAL;
      entry.type = V4L2_FRMIVAL_TYPE_DISCRETE;
      entry.discrete = {static_cast<std::uint32_t>(options_.interval_ns / 100), 10'000'000};
      return 0;
    }
    case VIDIOC_G_FMT:
      SetPix(static_cast<v4l2_format*>(argument)->fmt.pix);
      return 0;
    case VIDIOC_S_FMT:
      return SetFormat(*static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM:
    case VIDIOC_G_PARM: {
      v4l2_fract& interval = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
      interval = {static_cast<std::uint32_t>(options_.interval_ns / 100), 10'000'000};
      return 0;
    }
    case VIDIOC_QUERY_EXT_CTRL:
      return QueryControl(*static_cast<v4l2_query_ext_ctrl*>(argument));
    case VIDIOC_QUERYMENU:
      return QueryMenu(*static_cast<v4l2_querymenu*>(argument));
    case VIDIOC_G_EXT_CTRLS:
    case VIDIOC_S_EXT_CTRLS:
      return AccessControl(*static_cast<v4l2_ext_controls*>(argument),
                           request == VIDIOC_S_EXT_CTRLS);
    case VIDIOC_REQBUFS:
      return RequestBuffers(*static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= buffers_.size()) return -EINVAL;
      buffer.length = static_cast<std::uint32_t>(buffers_[buffer.index]->memory->size());
      buffer.m.offset = buffer.index * 4096;
      return 0;
    }
    case VIDIOC_QBUF: {
      const auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= buffers_.size() || buffers_[buffer.index]->queued) return -EINVAL;
      buffers_[buffer.index]->queued = true;
      if (streaming_) queue_.push_back(buffer.index);
      return 0;
    }
    case VIDIOC_DQBUF:
      return Dequeue(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_EXPBUF:
      static_cast<v4l2_exportbuffer*>(argument)->fd = next_descriptor_;
      descriptors_[next_descriptor_++] = plugged_times_;
      return 0;
    case VIDIOC_STREAMON:
      return StreamOn(true);
    case VIDIOC_STREAMOFF:
      return StreamOn(false);
    default:
      return -ENOTTY;
  }
}

}  // namespace scan
