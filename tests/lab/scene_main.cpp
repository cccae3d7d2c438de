// A UVC camera that shows what stands before it: lab_scene and the words of a scene (see scene.h).
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "tests/lab/scene.h"
#include "tests/lab/uvc_gadget.h"

namespace {

using namespace scan;

Status Serve(std::span<char* const> words) {
  SCAN_TRY(Scene made, MakeScene(words));
  const auto scene = std::make_shared<const Scene>(std::move(made));
  SCAN_TRY(const auto gadget,
           UvcGadget::Open([scene](const GadgetFrame& frame, std::span<std::uint8_t> out) {
             const std::vector<std::byte>* jpeg = frame.jpeg ? scene->Seen() : nullptr;
             if (!jpeg) return std::size_t{0};
             const std::size_t size = std::min(jpeg->size(), out.size());
             std::memcpy(out.data(), jpeg->data(), size);
             return size;
           }));
  gadget->Run();
}

}  // namespace

int main(int argc, char** argv) {
  const Status served = Serve({argv + 1, static_cast<std::size_t>(std::max(argc - 1, 0))});
  fmt::print(stderr, "lab_scene: {}\n", ToString(served.error()));
  return 1;
}
