#include "core/step/links/beam_batch.hpp"

#include <algorithm>

#include "core/step/linear/columns.hpp"
#include "core/step/links/beam_gradient.hpp"

namespace freeflex {
namespace {

constexpr std::size_t kNumConstants = 14, kNumEnds = 15, kNumResults = 11;  // rows of a block

FREEFLEX_KERNEL void set_block_to(const double* __restrict constants, const double* __restrict ends,
                                  double* __restrict results) noexcept {
  for (std::size_t lane = 0; lane < kBlock; ++lane) {
    const double *c = constants + lane, *e = ends + lane;
    BeamConstants beam;
    beam.length = entry(c, 3), beam.axial = entry(c, 4), beam.torsion = entry(c, 5);
    beam.symmetric = {entry(c, 6), entry(c, 7)};
    beam.antisymmetric = {entry(c, 8), entry(c, 9)};
    beam.shear = {entry(c, 10), entry(c, 11)};
    beam.skew_bow = {entry(c, 12), entry(c, 13)};
    BeamAngles angles;
    const BeamGradient g =
        beam_gradient<SmallAngle>(beam, vector_at(c, 0), vector_at(e, 0), {vector_at(e, 3), vector_at(e, 6)},
                                  {vector_at(e, 9), vector_at(e, 12)}, angles);
    double* const to = results + lane;
    put(g.force, to, 0), put(g.moment[0], to, 3), put(g.moment[1], to, 6);
    put(angles.largest_square, to, 9), put(angles.smallest_cosine, to, 10);
  }
}

FREEFLEX_KERNEL void set_blocks_to(const double* constants, const double* ends, std::size_t count,
                                   double* results) noexcept {
  for (std::size_t first = 0; first < count; first += kBlock) {
    set_block_to(constants, ends, results);
    constants += kNumConstants * kBlock, ends += kNumEnds * kBlock, results += kNumResults * kBlock;
  }
}

}  // namespace

BeamBatch make_beam_batch(const std::vector<PlanTrueBeam>& beams) {
  BeamBatch batch;
  const std::size_t padded = pad(beams.size());
  batch.constants.resize(kNumConstants * padded);
  batch.ends.resize(kNumEnds * padded);
  batch.results.resize(kNumResults * padded);
  for (std::size_t k = 0; k < padded; ++k) {
    // the last beam fills the rest of its block
    const PlanTrueBeam& plan = beams[std::min(k, beams.size() - 1)];
    const BeamConstants& beam = plan.constants;
    double* const c = column_of(batch.constants.data(), k, kNumConstants);
    put(plan.span, c, 0);
    put(beam.length, c, 3), put(beam.axial, c, 4), put(beam.torsion, c, 5);
    for (std::size_t p = 0; p < 2; ++p) {
      put(beam.symmetric[p], c, 6 + p), put(beam.antisymmetric[p], c, 8 + p);
      put(beam.shear[p], c, 10 + p), put(beam.skew_bow[p], c, 12 + p);
    }
    const Mat3& axes = plan.axes;
    const BeamEnd rest{{axes[0], axes[3], axes[6]}, {axes[1], axes[4], axes[7]}};
    set_beam(k, {}, rest, rest, batch);
  }
  return batch;
}

void set_beam(std::size_t beam, const Vec3& d, const BeamEnd& first, const BeamEnd& second,
              BeamBatch& batch) noexcept {
  double* const e = column_of(batch.ends.data(), beam, kNumEnds);
  put(d, e, 0), put(first.n, e, 3), put(first.y, e, 6), put(second.n, e, 9), put(second.y, e, 12);
}

void set_gradients(const std::vector<PlanTrueBeam>& beams, BeamBatch& batch) noexcept {
  run_auto<set_blocks_to>(static_cast<const double*>(batch.constants.data()),
                          static_cast<const double*>(batch.ends.data()), beams.size(), batch.results.data());
  for (std::size_t k = 0; k < beams.size(); ++k) {
    double* const to = column_of(batch.results.data(), k, kNumResults);
    if (is_small_angle(entry(to, 9), entry(to, 10))) continue;
    const double* const e = column_of(batch.ends.data(), k, kNumEnds);
    const BeamGradient g =
        gradient_of(beams[k].constants, beams[k].span, vector_at(e, 0), {vector_at(e, 3), vector_at(e, 6)},
                    {vector_at(e, 9), vector_at(e, 12)});
    put(g.force, to, 0), put(g.moment[0], to, 3), put(g.moment[1], to, 6);
  }
}

BeamGradient gradient_in(const BeamBatch& batch, std::size_t beam) noexcept {
  const double* const from = column_of(batch.results.data(), beam, kNumResults);
  BeamGradient g;
  g.force = vector_at(from, 0);
  g.moment[0] = vector_at(from, 3), g.moment[1] = vector_at(from, 6);
  return g;
}

}  // namespace freeflex
