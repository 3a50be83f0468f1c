#include "core/structure/prestress/axial_prestress.hpp"

#include <algorithm>
#include <cassert>

namespace freeflex {

AxialOrders axial_orders(const Scene& scene, std::span<const int> links, const Eigen::MatrixXd& shapes,
                         const std::vector<Prestress::Pair>& pairs) {
  assert(std::ranges::all_of(links, [&](int link) { return traits_of(scene.links[index(link)]).is_axial; }));
  const auto count = static_cast<Eigen::Index>(links.size());
  AxialOrders orders{Eigen::MatrixXd(count, shapes.cols()),
                     Eigen::MatrixXd(count, static_cast<Eigen::Index>(pairs.size()))};
  Eigen::Matrix3Xd direction(3, count);
  Eigen::VectorXd inverse_length(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Vector3d span = span_of(scene, scene.links[index(links[k])]);
    direction.col(k) = span.stableNormalized();
    inverse_length[k] = 1.0 / span.stableNorm();
  }
  int num_paired = 0;
  for (const Prestress::Pair& pair : pairs) num_paired = std::max({num_paired, pair[0] + 1, pair[1] + 1});
  // across[l] contains, for each link, the component of b_2 - b_1 in mode l that is normal to the link. The
  // products of these components give h_lu = (db_l . db_u - (u_0 . db_l) (u_0 . db_u)) / L   (THEORY 16.46)
  std::vector<Eigen::Matrix3Xd> across(index(num_paired), Eigen::Matrix3Xd(3, count));
  for (Eigen::Index mode = 0; mode < shapes.cols(); ++mode)
    for (Eigen::Index k = 0; k < count; ++k) {
      const std::vector<int>& points = scene.links[index(links[k])].points;
      const Eigen::Vector3d apart = shapes.block<3, 1>(3 * Eigen::Index{points[1]}, mode) -
                                    shapes.block<3, 1>(3 * Eigen::Index{points[0]}, mode);
      const double along = direction.col(k).dot(apart);
      orders.first(k, mode) = along;
      if (mode < num_paired) across[index(mode)].col(k) = apart - along * direction.col(k);
    }
  for (std::size_t pair = 0; pair < pairs.size(); ++pair)
    orders.second.col(static_cast<Eigen::Index>(pair)) =
        (across[index(pairs[pair][0])].cwiseProduct(across[index(pairs[pair][1])]))
            .colwise()
            .sum()
            .transpose()
            .cwiseProduct(inverse_length);
  return orders;
}

}  // namespace freeflex
