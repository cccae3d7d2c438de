// Internal: one maker per specimen.
#pragma once

#include <memory>

#include "reconstruction/specimens/specimen.h"

namespace scan::specimens {

std::unique_ptr<Specimen> MakeBeetle();
std::unique_ptr<Specimen> MakeOrchid();
std::unique_ptr<Specimen> MakeMushroom();
std::unique_ptr<Specimen> MakeTomato(bool bent_stalk);
std::unique_ptr<Specimen> MakeFlushedTomato();

}  // namespace scan::specimens
