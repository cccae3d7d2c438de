#include "reconstruction/surface/surface.h"

namespace scan {

Result<SurfaceResult> ExtractSurface(const Volume& volume, const SurfaceOptions& options,
                                     const ProgressFn& progress, std::stop_token stop) {
  const auto at = [&](double done) { Report(progress, "surface", done); };
  SurfaceResult out;
  SCAN_TRY(out.segmentation, Segment(volume, options.segment, progress, stop));
  if (stop.stop_requested()) return Cancelled("surface");
  at(0.1);
  ContouredSurface contoured = Isosurface(volume, out.segmentation, options.isosurface);
  out.mesh = std::move(contoured.mesh);
  out.specks = contoured.specks;
  out.speck_voxels = contoured.speck_voxels;
  if (stop.stop_requested()) return Cancelled("surface");
  at(0.4);
  out.clean = MakeManifold(out.mesh);
  out.clean.small_components =
      DropSmallComponents(out.mesh, options.least_component_share, options.segment.fill_cavities);
  if (out.mesh.faces.empty())
    return Failed("no surface at the threshold", "surface", "give another --threshold");
  at(0.6);
  Smooth(out.mesh, options.smoothing_iterations,
         options.smoothing_limit_voxels * volume.spacing_mm.minCoeff());
  if (stop.stop_requested()) return Cancelled("surface");
  at(0.7);
  out.faces_before_decimation = out.mesh.faces.size();
  SCAN_TRY(Decimation decimation, Decimate(out.mesh, options.decimate));
  out.mesh = std::move(decimation.mesh);
  out.quadric_error_mm = decimation.quadric_error_mm;
  out.max_deviation_mm = decimation.max_deviation_mm;
  out.rms_deviation_mm = decimation.rms_deviation_mm;
  out.topology = CheckTopology(out.mesh);
  if (!out.topology.closed_manifold())
    return Failed("the surface is not a closed manifold", "surface",
                  "report the volume that led to it");
  at(1.0);
  return out;
}

}  // namespace scan
