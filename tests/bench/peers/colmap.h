// COLMAP, the program, on the same photographs.
#pragma once

#include "drivers/base/result.h"
#include "peer.h"

namespace scan::bench {

// Features on the processor, every pair matched, one pinhole camera held at what is stated of it;
// the specimen's masks keep the background, which stands still, out. Of several models the one of
// most photographs. Errors: unavailable without the program, failed when it gives no model.
Result<PeerPoses> SolveWithColmap(const PeerScene& scene);

}  // namespace scan::bench
