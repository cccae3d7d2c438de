#include "reconstruction/specimens/specimen.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "reconstruction/specimens/beaded.h"
#include "reconstruction/specimens/catalogue.h"

namespace scan {

std::vector<std::string> SpecimenNames() {
  return {"beetle", "orchid", "mushroom", "tomato", "tomato-flushed", "tomato-stalk"};
}

Result<std::unique_ptr<Specimen>> MakeSpecimen(std::string_view name) {
  constexpr std::string_view kBeads = "+beads";
  if (name.ends_with(kBeads)) {
    SCAN_TRY(auto bare, MakeSpecimen(name.substr(0, name.size() - kBeads.size())));
    return WithBeads(std::move(bare));
  }
  if (name == "beetle") return specimens::MakeBeetle();
  if (name == "orchid") return specimens::MakeOrchid();
  if (name == "mushroom") return specimens::MakeMushroom();
  if (name == "tomato") return specimens::MakeTomato(false);
  if (name == "tomato-flushed") return specimens::MakeFlushedTomato();
  if (name == "tomato-stalk") return specimens::MakeTomato(true);
  return BadInput(fmt::format("unknown specimen '{}'", name), "specimen",
                  fmt::format("choose one of {}", fmt::join(SpecimenNames(), ", ")));
}

}  // namespace scan
