// What the internal forces of a loaded structure add to its stiffness, mode by mode.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/scene/scene.hpp"

namespace freeflex {

/// Stiffness that internal forces give the lowest modes   (THEORY X140): of the pair (l, u), per elastic
/// coordinate that strains the links, E_lu = sum_v rows(pair, v) q_v.
struct Prestress {
  using Pair = std::array<int, 2>;
  /// (l, l) of the lowest modes in order, then every (l, u) of the lowest num_shadowed, then those whose
  /// frequencies are near.
  std::vector<Pair> pairs;
  int num_modes = 0;          // of them (l, l)
  int num_shadowed = 0;       // modes whose error is integrated
  Eigen::MatrixXd rows;       // [N/m^2] (pairs x n) of all links but matrices and rigid ones
  Eigen::MatrixXd bent_rows;  // [N/m^2] the same without springs, bars and dashpots
  // [N s/m^2] (pairs x n) per rate of an elastic coordinate, by dashpots and viscous links
  Eigen::MatrixXd rate_rows, bent_rate_rows;
  bool has_unseen = false;  // links whose second order nothing tells: matrices, rigid links
  // [sqrt(N/m^3)] (num_modes) sqrt(beta_l): a mode's own displacement q adds beta_l q^2 when the others give
  // way (THEORY X146); of all links, and without springs, bars and dashpots
  Eigen::VectorXd root_quartic, bent_root_quartic;
  // [sqrt(N)/m^2] ((forms num_shadowed) x num_shadowed) of the modes whose error is integrated, when those
  // that are not give way: quartic_forms(); of all links, and without springs, bars and dashpots
  Eigen::MatrixXd quartic, bent_quartic;
};

/// Stiffness that the internal forces of one follower load give the lowest modes, at amplitude 1 (THEORY
/// X145).
struct FollowerStiffness {
  int load = -1;              // index into Scene::loads
  std::vector<int> modes;     // ascending
  Eigen::MatrixXd rows;       // [N/m] (modes x modes) of all links but matrices and rigid ones
  Eigen::MatrixXd bent_rows;  // [N/m] the same without springs, bars and dashpots
};

struct LinkFactor;
struct Structure;
/// \pre structure.omega and shapes; factor with its recovery
Prestress find_prestress(const Scene& scene, const LinkFactor& factor, const Structure& structure);
/// Of every load in local axes.  \pre as above
std::vector<FollowerStiffness> find_follower_stiffness(const Scene& scene, const LinkFactor& factor,
                                                       const Structure& structure);

/// The same when the modes from `first` on are replaced by others of their space, b <- b turn.
void turn_prestress(const Eigen::MatrixXd& turn, int first, Prestress& prestress);
void turn_follower_stiffness(const Eigen::MatrixXd& turn, int first, FollowerStiffness& stiffness);
/// What is left of it on some of the modes, ascending; they are numbered anew.
void reduce_follower_stiffness(const std::vector<int>& kept, FollowerStiffness& stiffness);

}  // namespace freeflex
