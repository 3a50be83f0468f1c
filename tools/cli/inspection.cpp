#include "tools/cli/inspection.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <numbers>
#include <utility>

#include "core/scene/bodies.hpp"
#include "core/scene/link_kinds.hpp"
#include "tools/terminal/json.hpp"

namespace freeflex::tools {
namespace {

std::vector<std::string> names_of(const Scene& scene, const std::vector<int>& points) {
  std::vector<std::string> names;
  names.reserve(points.size());
  for (const int point : points) names.push_back(scene.points[static_cast<std::size_t>(point)].name);
  return names;
}

Json json_of(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (const auto& row : matrix.rowwise()) rows.push_back(std::vector<double>(row.begin(), row.end()));
  return rows;
}

Json json_of(const Eigen::Vector3d& vector) { return {vector(0), vector(1), vector(2)}; }

Json json_of(const std::optional<Eigen::MatrixXd>& matrix, const std::string& absence) {
  Json out;
  out["exists"] = matrix.has_value();
  if (!matrix) {
    out["reason"] = absence;
    return out;
  }
  const MatrixSummary summary = summary_of(*matrix);
  out["size"] = matrix->rows();
  out["least_diagonal"] = summary.least_diagonal;
  out["largest_diagonal"] = summary.largest_diagonal;
  out["largest_off_diagonal"] = summary.largest_off_diagonal;
  out["symmetry_error"] = summary.symmetry_error;
  if (matrix->rows() <= kFullMatrices) out["matrix"] = json_of(*matrix);
  return out;
}

Json basis_json(const Inspection& inspection) {
  const Basis& basis = inspection.basis;
  Json out;
  out["recipe"] = name_of(basis.recipe);
  out["rank"] = basis.rank();
  out["expected"] = basis.num_expected;
  if (!basis.numbering.empty()) {
    out["rank_as_numbered"] = basis.rank_as_numbered;
    out["numbering"] = names_of(inspection.scene, basis.numbering);
    out["groups"] = basis.coefficients.cols();
    Json kept = Json::array(), skipped = Json::array();
    for (const int group : basis.choice.kept) kept.push_back(group_name(inspection, group));
    for (const int group : basis.choice.skipped) skipped.push_back(group_name(inspection, group));
    out["kept"] = kept;
    out["skipped"] = skipped;
    out["least_kept"] = basis.choice.least_kept;
    out["most_skipped"] = basis.choice.most_skipped;
    if (!basis.flat_window.empty()) out["flat_points"] = names_of(inspection.scene, basis.flat_window);
  }
  out["gram_error"] = basis.gram_error;
  out["force_residual"] = basis.force_residual;
  out["moment_residual"] = basis.moment_residual;
  out["constraint_residual"] = basis.constraint_residual;
  if (basis.num_expected <= kFullMatrices) {
    out["b"] = json_of(basis.shapes);
    if (!basis.numbering.empty()) out["C"] = json_of(basis.coefficients);
  }
  return out;
}

double conditioning_of_c(const Inspection& inspection) {
  return inspection.structure.conditioning * inspection.structure.conditioning;
}

}  // namespace

MatrixSummary summary_of(const Eigen::MatrixXd& matrix) {
  MatrixSummary summary;
  if (matrix.size() == 0) return summary;
  summary.least_diagonal = matrix.diagonal().minCoeff();
  summary.largest_diagonal = matrix.diagonal().maxCoeff();
  Eigen::MatrixXd off_diagonal = matrix;
  off_diagonal.diagonal().setZero();
  summary.largest_off_diagonal = off_diagonal.cwiseAbs().maxCoeff();
  const double largest = matrix.cwiseAbs().maxCoeff();
  if (largest > 0.0) summary.symmetry_error = (matrix - matrix.transpose()).cwiseAbs().maxCoeff() / largest;
  return summary;
}

std::optional<Inspection> inspect_scene(Scene scene, Structure structure, std::optional<Recipe> recipe,
                                        std::string& why_not) {
  if (!are_point_masses(scene)) {
    why_not =
        "the paper's bases are for point masses, but this scene has bodies or massless points; use freeflex "
        "modes";
    return std::nullopt;
  }
  Inspection inspection;
  inspection.scene = std::move(scene);
  inspection.structure = std::move(structure);
  Faults reported_before;
  const LinkFactor factor = factor_links(inspection.scene, false, reported_before);
  inspection.shape = shape_class(inspection.scene.points, inspection.structure.mass_properties);
  for (const Link& link : inspection.scene.links)
    if (traits_of(link).effect == LinkEffect::kForbids)
      inspection.num_rigid_rows +=
          static_cast<int>(rigid_rows(inspection.scene, link, Freedoms(inspection.scene)).size());
  inspection.basis = recipe ? find_basis(inspection.scene, inspection.structure, factor, *recipe, why_not)
                            : find_basis(inspection.scene, inspection.structure, factor);
  if (!why_not.empty()) return std::nullopt;
  inspection.maxwell = find_maxwell(inspection.scene, inspection.structure, factor, inspection.basis.shapes);
  const Maxwell& maxwell = inspection.maxwell;
  if (maxwell.c && maxwell.delta && inspection.basis.is_complete() && maxwell.c->size() > 0) {
    const auto size = maxwell.c->rows();
    inspection.inverse_error =
        (*maxwell.c * *maxwell.delta - Eigen::MatrixXd::Identity(size, size)).cwiseAbs().maxCoeff();
  }
  return inspection;
}

std::string group_name(const Inspection& inspection, int group) {
  const Basis& basis = inspection.basis;
  const auto name = [&](std::size_t number) {
    return inspection.scene.points[static_cast<std::size_t>(basis.numbering[number])].name;
  };
  const auto num_points = basis.numbering.size();
  auto index = static_cast<std::size_t>(group);
  if (basis.recipe == Recipe::kFormal) return name(index / 3) + " " + "xyz"[index % 3];
  // the pairs of points whose numbers differ by 1, 2, ... come first, and then the groups of three or four
  // neighbours
  const std::size_t last_apart = static_cast<std::size_t>(window_size(basis.recipe)) - 1;
  for (std::size_t apart = 1; apart <= last_apart && apart < num_points; ++apart) {
    if (index < num_points - apart) return name(index) + " - " + name(index + apart);
    index -= num_points - apart;
  }
  const std::size_t span = last_apart + 2;
  const std::size_t first = index % (num_points - span + 1);
  std::string text = name(first);
  for (std::size_t k = 1; k < span; ++k) text += " - " + name(first + k);
  return text;
}

Json to_json(const Inspection& inspection) {
  const Structure& structure = inspection.structure;
  const MassProperties& properties = structure.mass_properties;
  Json out;
  out["name"] = inspection.scene.name;
  out["points"] = inspection.scene.points.size();
  out["links"] = inspection.scene.links.size();
  out["mass"] = properties.mass;
  Json masses = Json::array();
  for (const PointMass& point : inspection.scene.points) masses.push_back(point.mass);
  out["masses"] = masses;
  out["centre"] = json_of(properties.p_SB);
  out["inertia"] = json_of(Eigen::MatrixXd(properties.inertia));
  out["principal_moments"] = json_of(properties.principal);
  out["principal_axes"] = json_of(Eigen::MatrixXd(properties.principal_axes.transpose()));
  out["shape"] = name_of(inspection.shape);
  out["rigid_freedoms"] = properties.rigid_freedoms;
  out["constraints"] = structure.num_constraints;
  out["redundant_constraints"] = inspection.num_rigid_rows - structure.num_constraints;
  out["elastic_freedoms"] = structure.omega.size();
  out["basis"] = basis_json(inspection);
  out["delta"] = json_of(inspection.maxwell.delta, inspection.maxwell.delta_absence);
  if (inspection.maxwell.delta) out["delta"]["redundant_links"] = inspection.maxwell.num_redundant;
  out["c"] = json_of(inspection.maxwell.c, inspection.maxwell.c_absence);
  out["inverse_error"] = inspection.inverse_error ? Json(*inspection.inverse_error) : Json();
  out["conditioning"] = conditioning_of_c(inspection);
  Json mechanisms = Json::array();
  for (const Mechanism& mechanism : structure.mechanisms)
    mechanisms.push_back(names_of(inspection.scene, mechanism.moved_points));
  out["mechanisms"] = mechanisms;
  Json frequencies = Json::array();
  for (const double omega : structure.omega) frequencies.push_back(omega / (2.0 * std::numbers::pi));
  out["frequencies"] = frequencies;
  out["frequency_accuracy"] = structure.frequency_accuracy;
  return out;
}

namespace {

void print_mass(const Inspection& inspection) {
  const MassProperties& properties = inspection.structure.mass_properties;
  double least = properties.mass, most = 0.0;
  for (const PointMass& point : inspection.scene.points) {
    least = std::min(least, point.mass);
    most = std::max(most, point.mass);
  }
  std::printf("mass               %.10g kg, points of %.4g to %.4g kg\n", properties.mass, least, most);
  std::printf("centre of mass     %.10g %.10g %.10g m (scene axes)\n", properties.p_SB(0), properties.p_SB(1),
              properties.p_SB(2));
  for (int row = 0; row < 3; ++row)
    std::printf("%-18s % .10g % .10g % .10g%s\n", row == 0 ? "inertia" : "", properties.inertia(row, 0),
                properties.inertia(row, 1), properties.inertia(row, 2), row == 0 ? " kg m^2" : "");
  std::printf("principal moments  %.10g %.10g %.10g kg m^2\n", properties.principal(0),
              properties.principal(1), properties.principal(2));
}

void print_freedoms(const Inspection& inspection) {
  const Structure& structure = inspection.structure;
  std::printf("shape              %s\n", name_of(inspection.shape));
  std::printf("rigid freedoms     %d\n", structure.mass_properties.rigid_freedoms);
  if (inspection.num_rigid_rows > 0)
    std::printf("constraints        %d by rigid links, %d more redundant\n", structure.num_constraints,
                inspection.num_rigid_rows - structure.num_constraints);
  std::printf("elastic freedoms   %d = 3 x %zu - %d - %d\n", static_cast<int>(structure.omega.size()),
              inspection.scene.points.size(), structure.mass_properties.rigid_freedoms,
              structure.num_constraints);
}

void print_shortage(const Inspection& inspection) {
  const Basis& basis = inspection.basis;
  if (basis.is_complete()) return;
  const auto short_by = basis.num_expected - static_cast<int>(basis.rank());
  std::printf("  the rank is short by %d; no numbering of the points was found that gives a complete basis",
              short_by);
  const char* where = basis.flat_window.size() == 2   ? "in one place"
                      : basis.flat_window.size() == 3 ? "on one line"
                                                      : "in one plane";
  if (!basis.flat_window.empty())
    std::printf(", because %s are consecutive and lie %s",
                listed(names_of(inspection.scene, basis.flat_window), 8).c_str(), where);
  std::printf("\n");
}

void print_basis(const Inspection& inspection) {
  const Basis& basis = inspection.basis;
  std::printf("basis              %s, rank %d of %d\n", name_of(basis.recipe), static_cast<int>(basis.rank()),
              basis.num_expected);
  print_shortage(inspection);
  if (!basis.numbering.empty()) {
    if (basis.rank_as_numbered < basis.rank())
      std::printf("  numbering        the order of the scene gives rank %d; the order used instead is %s\n",
                  basis.rank_as_numbered, listed(names_of(inspection.scene, basis.numbering), 24).c_str());
    std::vector<std::string> skipped;
    for (const int group : basis.choice.skipped) skipped.push_back(group_name(inspection, group));
    std::printf("  force groups     %d, of which %zu skipped%s%s\n",
                static_cast<int>(basis.coefficients.cols()), skipped.size(), skipped.empty() ? "" : ": ",
                listed(skipped, 12).c_str());
    std::printf(
        "  independence     each kept group is independent of earlier groups to at least %.2g, each skipped "
        "group to at most %.2g\n",
        basis.choice.least_kept, basis.choice.most_skipped);
    if (basis.rank() > 0) {
      double least = std::numeric_limits<double>::infinity(), most = 0.0;
      for (std::size_t l = 0; l < basis.choice.kept.size(); ++l) {
        const double own = basis.coefficients(static_cast<Eigen::Index>(l), basis.choice.kept[l]);
        least = std::min(least, own);
        most = std::max(most, own);
      }
      std::printf("  coefficients C   %d x %d, C_ll from %.6g to %.6g N\n", static_cast<int>(basis.rank()),
                  static_cast<int>(basis.coefficients.cols()), least, most);
    }
  }
  std::printf("  Gram error       %.1e\n", basis.gram_error);
  std::printf("  residuals        sum m b %.1e, sum m r x b %.1e, rigid links %.1e\n", basis.force_residual,
              basis.moment_residual, basis.constraint_residual);
}

void print_matrix(const char* name, const std::optional<Eigen::MatrixXd>& matrix, const std::string& absence,
                  const char* unit) {
  if (!matrix) {
    std::printf("%-18s does not exist: %s\n", name, absence.c_str());
    return;
  }
  const MatrixSummary summary = summary_of(*matrix);
  const auto size = static_cast<int>(matrix->rows());
  std::printf("%-18s %d x %d", name, size, size);
  if (size > 0)
    std::printf(", diagonal %.6g to %.6g %s, off-diagonal up to %.6g, asymmetry %.1e", summary.least_diagonal,
                summary.largest_diagonal, unit, summary.largest_off_diagonal, summary.symmetry_error);
  std::printf("\n");
}

void print_coefficients(const Inspection& inspection) {
  const Maxwell& maxwell = inspection.maxwell;
  print_matrix("delta", maxwell.delta, maxwell.delta_absence, "m/N");
  if (maxwell.delta && maxwell.num_redundant > 0)
    std::printf("  statically indeterminate to degree %d\n", maxwell.num_redundant);
  if (maxwell.delta && maxwell.num_redundant == 0) std::printf("  statically determinate\n");
  print_matrix("c", maxwell.c, maxwell.c_absence, "N/m");
  if (inspection.structure.conditioning > 0.0)
    std::printf("conditioning       %.3g of c%s\n", conditioning_of_c(inspection),
                inspection.structure.mechanisms.empty() ? "" : ", without mechanisms");
  if (inspection.inverse_error)
    std::printf("  c delta - 1      %.1e; conditioning allows about %.1e\n", *inspection.inverse_error,
                std::numeric_limits<double>::epsilon() * conditioning_of_c(inspection));
}

void print_motions(const Inspection& inspection) {
  const Structure& structure = inspection.structure;
  for (const Mechanism& mechanism : structure.mechanisms)
    std::printf("mechanism          moves %s, frequency 0\n",
                listed(names_of(inspection.scene, mechanism.moved_points), 8).c_str());
  const auto first = static_cast<Eigen::Index>(structure.mechanisms.size());
  const Eigen::Index num_left = structure.omega.size() - first;
  if (num_left == 0) return;
  constexpr Eigen::Index kShown = 8;
  std::printf("frequencies       ");
  for (Eigen::Index mode = 0; mode < std::min(kShown, num_left); ++mode)
    std::printf(" %.10g", structure.omega[first + mode] / (2.0 * std::numbers::pi));
  if (num_left > kShown)
    std::printf(" ... %.10g", structure.omega[structure.omega.size() - 1] / (2.0 * std::numbers::pi));
  std::printf(" Hz\n");
}

}  // namespace

void print_text(const Inspection& inspection) {
  std::printf("%s: %s, %s\n", inspection.scene.name.c_str(),
              counted(static_cast<std::int64_t>(inspection.scene.points.size()), "point").c_str(),
              counted(static_cast<std::int64_t>(inspection.scene.links.size()), "link").c_str());
  print_mass(inspection);
  print_freedoms(inspection);
  print_basis(inspection);
  print_coefficients(inspection);
  print_motions(inspection);
}

}  // namespace freeflex::tools
