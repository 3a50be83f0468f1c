#include "core/structure/structure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <numbers>
#include <numeric>
#include <tuple>

#include "core/limits.hpp"
#include "core/rounding.hpp"
#include "core/scene/bodies.hpp"
#include "core/scene/check/check_scene.hpp"
#include "core/scene/check/extremes.hpp"
#include "core/structure/body_modes.hpp"
#include "core/structure/links/link_factor.hpp"
#include "core/structure/masses/mass_properties.hpp"
#include "core/structure/modes/dense/mechanisms.hpp"
#include "core/structure/modes/dense/normal_modes.hpp"
#include "core/structure/modes/dense/rigid_residual.hpp"
#include "core/structure/modes/sparse/sparse_modes.hpp"
#include "core/structure/reduce.hpp"

namespace freeflex {
namespace {

constexpr int kNamesInWarning = 8;
// [-] two modes with frequencies within this relative distance are both kept or both omitted
constexpr double kPairGap = 1e-6;

// Returns whether mass properties can be computed. If they cannot, check_scene() has already reported the
// invalid values
bool are_sound(const Scene& scene) {
  const auto is_known = [&](int point) {
    return point >= 0 && point < static_cast<int>(scene.points.size());
  };
  const auto is_sized = [](const Link& link) {
    const MatrixLink* matrix = matrices_of(link);
    return matrix == nullptr || matrix->mass.rows() == num_rows(*matrix, link.points.size());
  };
  const bool has_points = !scene.points.empty() &&
                          std::all_of(scene.points.begin(), scene.points.end(), [](const PointMass& point) {
                            return std::isfinite(point.mass) && point.mass >= 0.0 &&
                                   point.position.allFinite() && point.offset.allFinite() &&
                                   inertia_problem(point.inertia).empty();
                          });
  if (!has_points || !std::all_of(scene.links.begin(), scene.links.end(), [&](const Link& link) {
        const LinkTraits kind = traits_of(link);
        return !has_mass(link) || (link.points.size() >= kind.least && link.points.size() <= kind.most &&
                                   std::all_of(link.points.begin(), link.points.end(), is_known) &&
                                   is_sized(link) && std::isfinite(mass_of(scene, link)));
      }))
    return false;
  double mass = 0.0;
  for (const PointMass& point : scene.points) mass += point.mass;
  for (const Link& link : scene.links) mass += mass_of(scene, link);
  return mass > 0.0;
}

bool has_rigid_links(const Scene& scene) {
  return std::any_of(scene.links.begin(), scene.links.end(), [](const Link& link) { return is_rigid(link); });
}

// Returns the number of elastic modes of point masses. In scenes with bodies this number is known only after
// the modes are found
int num_elastic(const Scene& scene, const MassProperties& properties, Eigen::Index num_constraints) {
  return 3 * static_cast<int>(scene.points.size()) - properties.rigid_freedoms -
         static_cast<int>(num_constraints);
}

Eigen::VectorXd mass_of(const std::vector<PointMass>& points) {
  Eigen::VectorXd mass(static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < mass.size(); ++i) mass[i] = points[static_cast<std::size_t>(i)].mass;
  return mass;
}

// The factorization checks the matrices. If other errors prevent the factorization, this function checks the
// matrices.
void check_matrices(const Scene& scene, Faults& faults) {
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    const MatrixLink* matrix = matrices_of(scene.links[i]);
    const std::vector<int>& points = scene.links[i].points;
    if (matrix == nullptr || points.size() < 2 || is_superelement(*matrix)) continue;
    const auto size = 3 * static_cast<Eigen::Index>(points.size());
    const bool is_known = std::all_of(points.begin(), points.end(), [&](int point) {
      return point >= 0 && point < static_cast<int>(scene.points.size());
    });
    MatrixLimits limits;
    if (is_known && matrix->matrix.rows() == size && matrix->matrix.cols() == size)
      matrix_rows(scene, scene.links[i], static_cast<int>(i), limits, faults);
  }
}

void warn_of_mechanisms(const Scene& scene, const std::vector<Mechanism>& mechanisms, Faults& faults) {
  for (std::size_t k = 0; k < mechanisms.size(); ++k) {
    const std::vector<int>& moved = mechanisms[k].moved_points;
    add_warning(faults, scene.points[static_cast<std::size_t>(moved.front())].origin,
                join_text("mechanism ", k + 1, " of ", mechanisms.size(), ": ",
                          point_names(scene, moved, kNamesInWarning), moved.size() == 1 ? " moves" : " move",
                          " without straining any link, so the mechanism is kept with frequency zero; add "
                          "links if that is not meant"));
  }
}

// warns of coincident points, a likely mistake that no other check finds
void warn_of_coincident_points(const Scene& scene, Faults& faults) {
  std::vector<std::size_t> order(scene.points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto position = [&](std::size_t i) {
    const Eigen::Vector3d& at = scene.points[i].position;
    return std::make_tuple(at[0], at[1], at[2]);
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return position(a) < position(b); });
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (position(order[k - 1]) != position(order[k])) continue;
    const PointMass& point = scene.points[order[k]];
    add_warning(
        faults, point.origin,
        join_text("point ", quoted(point.name, static_cast<int>(order[k])), " and point ",
                  quoted(scene.points[order[k - 1]].name, static_cast<int>(order[k - 1])),
                  " are in one place, but are not joined to each other; merge them, or move one of them"));
  }
}

// for point masses, finds the mechanisms (THEORY 4.4), then the elastic modes with sum m b.b = M (THEORY 4.3)
void find_modes(const Scene& scene, const LinkFactor& factor, Structure& structure) {
  // motions that rigid links forbid are not mechanisms, so the constraints are added to the unit rows
  Eigen::MatrixXd held(factor.unit_rows.rows() + factor.constraints.rows(), factor.unit_rows.cols());
  held << factor.unit_rows, factor.constraints;
  const Eigen::MatrixXd rigid = rigid_motions(structure.mass_properties);
  Mechanisms mechanisms =
      find_mechanisms(held, rigid, {structure.mass_properties.r, {}, {}}, direction_rounding(scene));
  structure.mechanisms = std::move(mechanisms.names);
  const EckartComplement complement(RootMass(scene.points), structure.mass_properties.mass, rigid,
                                    factor.constraints, mechanisms.motions);
  NormalModes modes = normal_modes(factor.rows, complement);
  structure.omega = std::move(modes.omega);
  structure.shapes = std::move(modes.motions);
  fix_signs(structure.shapes);
  structure.frequency_accuracy = std::max(modes.accuracy, factor.matrices.accuracy);
  structure.conditioning = modes.conditioning;
  structure.particles = {mass_of(scene.points), structure.mass_properties.r, {}};
}

// Refuses published rigid links, because their forces (THEORY 5.6) need all modes and a dense factor of the
// constraints
void refuse_rigid_forces(const Scene& scene, Faults& faults) {
  for (const int index : scene.publication.links) {
    const Link& link = scene.links[static_cast<std::size_t>(index)];
    if (traits_of(link).effect != LinkEffect::kForbids) continue;
    return add_error(faults, link.origin,
                     join_text("rigid link ", called(link, index),
                               " is published, but forces of rigid "
                               "links are unknown if only some modes are kept; publish forces of elastic "
                               "links next to it, or replace it by a stiff bar or beam"));
  }
}

bool needs_recovery(const Scene& scene) {
  return std::any_of(scene.links.begin(), scene.links.end(),
                     [](const Link& link) { return traits_of(link).has_joint_rotations; });
}

// returns the damping ratios due to loss factors, sum_k eta_k E_kl / (2 E_l), where E_kl is the strain energy
// of link k in mode l, and E_l is the strain energy of all links (THEORY 4.24)
Eigen::VectorXd structural_ratio(const Scene& scene, const LinkFactor& factor, const Structure& structure) {
  Eigen::VectorXd ratio = Eigen::VectorXd::Zero(structure.omega.size());
  for (std::size_t i = 0; i < scene.links.size(); ++i) {
    if (scene.links[i].loss_factor == 0.0) continue;
    const RowRange range = factor.natural_of[i];
    const Eigen::MatrixXd forces = natural_forces(factor, structure, static_cast<int>(i));
    for (int k = 0; k < range.count; ++k) {
      const double root = natural_row(factor, range, k).root_stiffness;
      ratio +=
          0.5 * scene.links[i].loss_factor * (forces.row(k) / root).array().square().matrix().transpose();
    }
  }
  for (Eigen::Index mode = 0; mode < ratio.size(); ++mode) {
    const double energy = structure.mass_properties.mass * structure.omega[mode] * structure.omega[mode];
    ratio[mode] = energy > 0.0 ? ratio[mode] / energy : 0.0;
  }
  return ratio;
}

}  // namespace

MassProperties check_physics(const Scene& scene, Faults& faults) {
  check_scene(scene, faults);
  MassProperties properties;
  if (are_sound(scene)) {
    properties = find_mass_properties(scene, faults);
    if (!has_rigid_links(scene) && are_point_masses(scene) && !takes_sparse_path(scene))
      check_modes(scene, num_elastic(scene, properties, 0), faults);
  }
  if (has_error(faults)) check_matrices(scene, faults);
  return properties;
}

namespace {

// checks the mode numbers in the scene if rigid links between point masses reduce the number of modes
void check_asked_modes(const Scene& scene, const LinkFactor& factor, const Structure& structure,
                       Faults& faults) {
  if (has_rigid_links(scene) && are_point_masses(scene))
    check_modes(scene, num_elastic(scene, structure.mass_properties, factor.constraints.rows()), faults);
}

// finds all modes by the dense factor
void find_all_modes(const Scene& scene, const LinkFactor& factor, Structure& structure, Faults& faults) {
  check_asked_modes(scene, factor, structure, faults);
  if (has_error(faults)) return;
  structure.num_constraints = static_cast<int>(factor.constraints.rows());
  if (are_point_masses(scene)) {
    find_modes(scene, factor, structure);
    return;
  }
  find_body_modes(scene, factor, structure, faults);
  if (!has_error(faults)) check_modes(scene, static_cast<int>(structure.omega.size()), faults);
}

// finds the modes that the scene requests, by default at most kModesByDefault modes below half the tick rate
void find_lowest_modes(const Scene& scene, const LinkFactor& factor, const SetupProgress& progress,
                       Structure& structure, StaticResponses& responses, Faults& faults) {
  refuse_rigid_forces(scene, faults);
  if (has_error(faults)) return;
  structure.num_constraints = static_cast<int>(factor.constraint_rows.size());
  ModesWanted wanted{scene.modes.below, scene.modes.count};
  if (!scene.modes.is_asked()) wanted = {0.5 * scene.rate, kModesByDefault};
  responses = find_sparse_modes(scene, factor, wanted, progress, structure, faults);
  if (!has_error(faults)) check_modes(scene, static_cast<int>(structure.omega.size()), faults);
}

// Reduces all modes to the modes that the scene requests. Modes of equal frequency are kept together
Structure keep_asked(const Scene& scene, Structure structure) {
  const Eigen::Index n = structure.omega.size();
  const double below = 2.0 * std::numbers::pi * scene.modes.below;
  Eigen::Index count = n;
  if (scene.modes.count > 0) count = std::min<Eigen::Index>(n, scene.modes.count);
  if (below > 0.0) count = (structure.omega.array() < below).count();
  while (count > 0 && count < n &&
         structure.omega[count] - structure.omega[count - 1] <= kPairGap * structure.omega[count])
    ++count;
  if (count == n) return structure;
  std::vector<int> kept(static_cast<std::size_t>(count));
  std::iota(kept.begin(), kept.end(), 0);
  const double next = structure.omega[count];
  structure = reduce(structure, kept);
  structure.kept = {true, next / (2.0 * std::numbers::pi)};
  return structure;
}

void fill_rest(const Scene& scene, const LinkFactor& factor, const StaticResponses& responses,
               Structure& structure, Faults& faults) {
  // R = A_d b   (THEORY 3.49)
  structure.damping_rows = factor.is_sparse ? rows_times(factor.damping, structure.shapes)
                                            : Eigen::MatrixXd(factor.damping_rows * structure.shapes);
  if (!structure.omega.allFinite() || !structure.shapes.allFinite())
    return add_overflow(scene, "the frequencies are not finite", faults);
  account_for_rigid_residuals(scene, factor.matrices.rigid_residuals, structure, faults);
  structure.structural_ratio = structural_ratio(scene, factor, structure);
  structure.local_rotations = local_rotations(scene, factor, structure);
  set_link_forces(scene, factor, structure);
  structure.load_stiffness = find_load_stiffness(scene, factor, structure, responses);
}

// Builds the structure and reports each stage to `progress`. The return value of `progress` can end only the
// sparse path
std::optional<Structure> build_in_stages(const Scene& scene, SetupPath path, Faults& faults,
                                         const SetupProgress& progress) {
  Structure structure;
  structure.mass_properties = check_physics(scene, faults);
  if (has_error(faults)) return std::nullopt;
  structure.resolved = resolve(scene);
  warn_of_coincident_points(scene, faults);
  const bool is_sparse = path == SetupPath::kSparse;
  const auto report = [&](const char* what, double done) {
    if (progress.report(what, done) || !is_sparse) return true;
    add_error(faults, scene.points.front().origin, kSetupEnded);
    return false;
  };
  if (!report("the matrix of the links", 0.0)) return std::nullopt;
  const LinkFactor factor =
      is_sparse ? factor_links_sparse(scene, faults) : factor_links(scene, needs_recovery(scene), faults);
  if (has_error(faults)) return std::nullopt;
  StaticResponses responses;
  if (!is_sparse) report("all modes", 0.0);
  if (is_sparse)
    find_lowest_modes(scene, factor, progress, structure, responses, faults);
  else
    find_all_modes(scene, factor, structure, faults);
  if (has_error(faults)) return std::nullopt;
  if (!is_sparse) responses = static_responses(scene, structure);
  if (!is_sparse && scene.modes.is_asked()) {
    structure = keep_asked(scene, std::move(structure));
    check_modes(scene, static_cast<int>(structure.omega.size()), faults);
    if (has_error(faults)) return std::nullopt;
  }
  warn_of_mechanisms(scene, structure.mechanisms, faults);
  if (!report("forces of links", 0.0)) return std::nullopt;
  fill_rest(scene, factor, responses, structure, faults);
  if (has_error(faults)) return std::nullopt;
  return structure;
}

}  // namespace

bool takes_sparse_path(const Scene& scene) {
  return static_cast<int>(scene.points.size()) > kMaxDensePoints ||
         (scene.modes.is_asked() && Freedoms(scene).num_all() > kMostDenseForSomeModes);
}

std::optional<Structure> build_structure(const Scene& scene, Faults& faults, const SetupProgress& progress) {
  return build_structure_by(scene, takes_sparse_path(scene) ? SetupPath::kSparse : SetupPath::kDense, faults,
                            progress);
}

std::optional<Structure> build_structure_by(const Scene& scene, SetupPath path, Faults& faults,
                                            const SetupProgress& progress) {
  std::string stage = "checking the scene";
  const auto report = [&](const std::string& what, double done) {
    stage = what;
    return !progress.report || progress.report(what, done);
  };
  try {
    return build_in_stages(scene, path, faults, {report, progress.memory_MB, progress.share});
  } catch (const std::bad_alloc&) {
    add_error(faults, scene.points.empty() ? Origin{} : scene.points.front().origin,
              join_text("memory ran out in the set-up of ", scene.points.size(), " points, at ", stage,
                        kMoreMemory));
    return std::nullopt;
  }
}

std::vector<FrequencyCluster> frequency_clusters(const Eigen::VectorXd& omega, double relative_gap) {
  std::vector<FrequencyCluster> clusters;
  for (int mode = 0; mode < omega.size(); ++mode) {
    const bool joins = mode > 0 && omega[mode] - omega[mode - 1] <= relative_gap * omega[mode];
    if (joins) {
      ++clusters.back().count;
    } else {
      clusters.push_back({mode, 1});
    }
  }
  return clusters;
}

}  // namespace freeflex
