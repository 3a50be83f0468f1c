#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>

#include "core/structure/modes/dense/decompositions.hpp"
#include "core/structure/structure.hpp"
#include "tools/verification/stability/answers.hpp"
#include "tools/verification/stability/ride.hpp"
#include "tools/verification/stability/scenes.hpp"

namespace freeflex::tools {
namespace {

using Wide = boost::multiprecision::cpp_bin_float_50;

constexpr const char* kRatios = "stiffness and mass ratios";
constexpr const char* kThin = "thin shapes";

Scene collinear(double width, double is_tilted) { return nearly_collinear(width, is_tilted != 0.0); }
Scene planar(double height, double is_tilted) { return nearly_planar(height, is_tilted != 0.0); }

/// Returns the limit of the relative error for thin shapes: a few rounding errors of coordinates of some
/// metres, divided by the width, because only the width stiffens the soft modes.
constexpr double thin_limit(double width) { return 1e-9 + 3e-15 / width; }

const FrequencyAnswer kAnswers[] = {
    {kRatios, "stiffness ratio 1e8", stiff_truss, 1e8, 1e0, "18.01735477349135079674332", 1e-8},
    {kRatios, "stiffness ratio 1e10", stiff_truss, 1e10, 1e0, "18.01735485137178897136375", 1e-8},
    {kRatios, "stiffness ratio 1e12", stiff_truss, 1e12, 1e0, "18.01735485215059335513615", 1e-8},
    {kRatios, "stiffness ratio 1e15", stiff_truss, 1e15, 1e0, "18.01735485215845219937261", 1e-8},
    {kRatios, "mass ratio 1e4", stiff_truss, 1e0, 1e4, "0.1693761869897994705750321", 1e-8},
    {kRatios, "mass ratio 1e8", stiff_truss, 1e0, 1e8, "0.001693821790886820917560917", 1e-8},
    {kRatios, "mass ratio 1e12", stiff_truss, 1e0, 1e12, "1.6938217968790569097376e-05", 1e-8},
    {kRatios, "stiffness ratio 1e12, mass ratio 1e4", stiff_truss, 1e12, 1e4, "0.2430455628078695731109063",
     1e-8},
    {kRatios, "stiffness ratio 1e15, mass ratio 1e4", stiff_truss, 1e15, 1e4, "0.2430455628079857616055743",
     1e-8},
    {kRatios, "stiffness ratio 1e15, mass ratio 1e12", stiff_truss, 1e15, 1e12,
     "2.430539061360411732089467e-05", 1e-8},
    {kThin, "nearly collinear, width 1e-4 m of 3", collinear, 1e-4, 0.0, "0.0002631478160739301234928674",
     thin_limit(1e-4)},
    {kThin, "nearly collinear, width 1e-6 m of 3", collinear, 1e-6, 0.0, "2.63147816663798861419884e-06",
     thin_limit(1e-6)},
    {kThin, "nearly collinear, width 1e-8 m of 3", collinear, 1e-8, 0.0, "2.631478166638579110580469e-08",
     thin_limit(1e-8)},
    {kThin, "nearly collinear, width 1e-10 m of 3", collinear, 1e-10, 0.0, "2.631478166638579073270683e-10",
     thin_limit(1e-10)},
    {kThin, "nearly collinear, width 1e-12 m of 3", collinear, 1e-12, 0.0, "2.631478166638579161655459e-12",
     thin_limit(1e-12)},
    {kThin, "nearly collinear, width 1e-4 m of 3, askew", collinear, 1e-4, 1.0,
     "0.0002631478160743725069410286", thin_limit(1e-4)},
    {kThin, "nearly collinear, width 1e-6 m of 3, askew", collinear, 1e-6, 1.0,
     "2.63147816456106444643745e-06", thin_limit(1e-6)},
    {kThin, "nearly collinear, width 1e-8 m of 3, askew", collinear, 1e-8, 1.0,
     "2.631477661689436342382285e-08", thin_limit(1e-8)},
    {kThin, "nearly collinear, width 1e-10 m of 3, askew", collinear, 1e-10, 1.0,
     "2.631443002617337898741177e-10", thin_limit(1e-10)},
    {kThin, "nearly collinear, width 1e-12 m of 3, askew", collinear, 1e-12, 1.0,
     "2.634903790415456877779633e-12", thin_limit(1e-12)},
    {kThin, "nearly planar, height 1e-4 m of 1", planar, 1e-4, 0.0, "0.005730626205249905797145908",
     thin_limit(1e-4)},
    {kThin, "nearly planar, height 1e-6 m of 1", planar, 1e-6, 0.0, "5.730626250916136835120383e-05",
     thin_limit(1e-6)},
    {kThin, "nearly planar, height 1e-8 m of 1", planar, 1e-8, 0.0, "5.730626250920704062668318e-07",
     thin_limit(1e-8)},
    {kThin, "nearly planar, height 1e-10 m of 1", planar, 1e-10, 0.0, "5.73062625092070423727761e-09",
     thin_limit(1e-10)},
    {kThin, "nearly planar, height 1e-12 m of 1", planar, 1e-12, 0.0, "5.730626250920704074753048e-11",
     thin_limit(1e-12)},
    {kThin, "nearly planar, height 1e-4 m of 1, askew", planar, 1e-4, 1.0, "0.00573062620524912102641966",
     thin_limit(1e-4)},
    {kThin, "nearly planar, height 1e-6 m of 1, askew", planar, 1e-6, 1.0, "5.730626251181189469119248e-05",
     thin_limit(1e-6)},
    {kThin, "nearly planar, height 1e-8 m of 1, askew", planar, 1e-8, 1.0, "5.730626284309321363295979e-07",
     thin_limit(1e-8)},
    {kThin, "nearly planar, height 1e-10 m of 1, askew", planar, 1e-10, 1.0, "5.730628455275676788052852e-09",
     thin_limit(1e-10)},
    {kThin, "nearly planar, height 1e-12 m of 1, askew", planar, 1e-12, 1.0, "5.730661770058201389458712e-11",
     thin_limit(1e-12)},
};

/// Returns the lowest frequency [rad/s] of a scene of springs by an eigensolver on the assembled stiffness,
/// in double precision.
double assembled_lowest(const Scene& scene) {
  const auto size = 3 * static_cast<Eigen::Index>(scene.points.size());
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(size, size);
  for (const Link& link : scene.links) {
    const auto a = index(link.points[0]), b = index(link.points[1]);
    const Eigen::Vector3d u = (scene.points[b].position - scene.points[a].position).normalized();
    const double k = std::get<Spring>(link.kind).stiffness;
    for (const std::size_t i : {a, b})
      for (const std::size_t j : {a, b})
        K.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j)) +=
            (i == j ? k : -k) / std::sqrt(scene.points[i].mass * scene.points[j].mass) * (u * u.transpose());
  }
  constexpr Eigen::Index kRigid = 6;
  return std::sqrt(std::abs(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues()[kRigid]));
}

Outcome measure_lowest(const FrequencyAnswer& answer, const StabilityOptions& options) {
  const Scene scene = answer.make(answer.first, answer.second);
  Faults faults;
  const auto structure = build_structure(scene, faults);
  if (!structure) return no_answer(faults.empty() ? "" : faults.front().message);
  const auto expected = static_cast<Eigen::Index>(3 * scene.points.size() - 6);
  if (structure->omega.size() != expected || !structure->mechanisms.empty())
    return no_answer(format_text("there are %d elastic modes and %zu mechanisms, but %d and 0 are expected",
                                 static_cast<int>(structure->omega.size()), structure->mechanisms.size(),
                                 static_cast<int>(expected)));
  const Wide exact(answer.lowest);
  const auto error = [&exact](double omega) {
    return std::abs(static_cast<double>((Wide(omega) - exact) / exact));
  };
  Outcome outcome;
  outcome.measured = error(structure->omega[0]);
  outcome.message = format_text("%.6g rad/s; the stated accuracy is %.0e", structure->omega[0],
                                structure->frequency_accuracy);
  // the stated accuracy must not be smaller than the true error
  if (outcome.measured > structure->frequency_accuracy) {
    outcome.message += ", which is less than the true error";
    outcome.measured = NAN;
  }
  if (options.has_peers)
    outcome.peers.push_back({"eigensolver on assembled K", error(assembled_lowest(scene)), {}});
  return outcome;
}

}  // namespace

std::span<const FrequencyAnswer> frequency_answers() { return kAnswers; }

void add_frequency_cases(std::vector<StabilityCase>& cases) {
  for (const FrequencyAnswer& answer : kAnswers)
    cases.push_back({answer.group, answer.name, "relative error of the lowest frequency, against 60 digits",
                     answer.limit, false,
                     [&answer](const StabilityOptions& options) { return measure_lowest(answer, options); }});
}

}  // namespace freeflex::tools
