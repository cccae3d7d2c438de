#include "reconstruction/specimens/specimen.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "reconstruction/specimens/catalogue.h"

namespace scan {

std::vector<std::string> SpecimenNames() { return {"beetle"}; }

Result<std::unique_ptr<Specimen>> MakeSpecimen(std::string_view name) {
  if (name == "beetle") return specimens::MakeBeetle();
  return BadInput(fmt::format("unknown specimen '{}'", name), "specimen",
                  fmt::format("choose one of {}", fmt::join(SpecimenNames(), ", ")));
}

}  // namespace scan
