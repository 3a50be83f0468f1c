#include "tools/view/body.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <set>
#include <variant>

#include "core/plan/file/plan_bytes.hpp"
#include "core/plan/make_plan.hpp"
#include "core/plan/rungs/rates.hpp"
#include "core/scene/link_kinds.hpp"
#include "core/step/linear/kernels.hpp"
#include "core/step/state.hpp"
#include "service/io/scene/input.hpp"

namespace freeflex::tools {
namespace {

constexpr std::size_t kAlignment = 8;
constexpr std::size_t kMostNamed = 200'000;  // points

/// Draws the convex hull of a link's points as triangles. If the points are fewer than four, too many, or on
/// a line, draws nothing and returns false.
bool draw_hull(std::uint32_t link, std::span<const int> points, Body& body) {
  constexpr std::size_t kMostOfHull = 24;  // largest number of points, because every triple is tried
  constexpr double kFlat = 1e-9;           // [-] relative to the size
  if (points.size() < 4 || points.size() > kMostOfHull) return false;
  std::vector<Eigen::Vector3d> at;
  for (const int point : points) at.emplace_back(body.plan.points[index(point)].r.data());
  double size = 0.0;
  for (const Eigen::Vector3d& each : at) size = std::max(size, (each - at[0]).norm());
  const std::size_t before = body.triangles.size();
  for (std::size_t a = 0; a < at.size(); ++a)
    for (std::size_t b = a + 1; b < at.size(); ++b)
      for (std::size_t c = b + 1; c < at.size(); ++c) {
        const Eigen::Vector3d normal = (at[b] - at[a]).cross(at[c] - at[a]);
        if (normal.norm() <= kFlat * size * size) continue;
        double least = 0.0, most = 0.0;
        for (const Eigen::Vector3d& other : at) {
          const double height = normal.normalized().dot(other - at[a]);
          least = std::min(least, height), most = std::max(most, height);
        }
        if (std::min(-least, most) > kFlat * size) continue;  // points on both sides
        for (const std::size_t corner : {a, b, c})
          body.triangles.push_back(static_cast<std::uint32_t>(points[corner]));
        body.triangle_links.push_back(link);
      }
  return body.triangles.size() > before;
}

/// Draws a link as lines or triangles.
void draw(std::uint32_t link, LinkDrawing drawing, std::span<const int> points, Body& body) {
  if (drawing == LinkDrawing::kNothing) return;
  if (drawing == LinkDrawing::kHull && draw_hull(link, points, body)) return;
  if (drawing == LinkDrawing::kTriangle && points.size() == 3) {
    for (const int point : points) body.triangles.push_back(static_cast<std::uint32_t>(point));
    body.triangle_links.push_back(link);
    return;
  }
  // draws lines from the first point to all other points
  for (std::size_t k = 1; k < points.size(); ++k) {
    body.lines.insert(body.lines.end(),
                      {static_cast<std::uint32_t>(points[0]), static_cast<std::uint32_t>(points[k])});
    body.line_links.push_back(link);
  }
}

/// Draws a matrix as lines from each point to the points that it is coupled to most strongly, because nothing
/// else is known about its structure.
void draw(std::uint32_t link, const MatrixLink& matrix, std::span<const int> points, Body& body) {
  constexpr std::size_t kMostOfOne = 6;
  const Eigen::Index stride = matrix.has_rotations ? 6 : 3, end = stride * std::ssize(points);
  // of each point: sums of the squares of the entries that couple it with another point
  std::vector<std::map<Eigen::Index, double>> coupling(points.size());
  for (Eigen::Index column = 0; column < std::min(end, matrix.matrix.outerSize()); ++column)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(matrix.matrix, column); entry; ++entry)
      if (entry.row() < end && entry.row() / stride != column / stride)
        coupling[index(column / stride)][entry.row() / stride] += entry.value() * entry.value();
  std::set<std::pair<Eigen::Index, Eigen::Index>> pairs;
  for (std::size_t k = 0; k < points.size(); ++k) {
    std::vector<std::pair<double, Eigen::Index>> most;
    for (const auto& [other, square] : coupling[k]) most.emplace_back(-square, other);
    std::sort(most.begin(), most.end());
    most.resize(std::min(most.size(), kMostOfOne));
    for (const auto& [square, other] : most)
      if (square < 0.0) pairs.insert(std::minmax(static_cast<Eigen::Index>(k), other));
  }
  for (const auto& [a, b] : pairs) {
    for (const Eigen::Index end_of_line : {a, b})
      body.lines.push_back(static_cast<std::uint32_t>(points[index(end_of_line)]));
    body.line_links.push_back(link);
  }
}

/// Mode shapes of the lowest modes, point by point within a mode: (3 x points x modes).
using Shapes = std::vector<float>;

int modes_that_fit(const Plan& plan) {
  const std::size_t of_one = 3 * sizeof(float) * std::max<std::size_t>(1, plan.points.size());
  return static_cast<int>(std::min<std::size_t>(index(plan.num_elastic), kMostShapeBytes / of_one));
}

Shapes shapes_of(const Structure& structure, const Plan& plan, int num_modes) {
  Shapes shapes;
  shapes.reserve(index(structure.shapes.rows() * num_modes));
  for (int l = 0; l < num_modes; ++l) {
    const Eigen::Index column = plan.mode_numbers.empty() ? l : plan.mode_numbers[index(l)] - 1;
    for (Eigen::Index row = 0; row < structure.shapes.rows(); ++row)
      shapes.push_back(static_cast<float>(structure.shapes(row, column)));
  }
  return shapes;
}

Shapes shapes_of(const Plan& plan, int num_modes) {
  const std::size_t of_one = 3 * plan.points.size();
  Shapes shapes(of_one * index(num_modes), 0.0F);
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    if (plan.points[i].row < 0) continue;
    const double* rows = point_rows(plan, plan.points[i].row);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t l = 0; l < index(num_modes); ++l)
        shapes[l * of_one + 3 * i + axis] = static_cast<float>(rows[axis * index(plan.num_padded) + l]);
  }
  return shapes;
}

/// Returns the names of the items, or an empty list if each name is the item's number.
template <typename Items>
Json names_of(const Items& items) {
  Json names = Json::array();
  bool are_numbers = true;
  for (std::size_t k = 0; k < items.size(); ++k)
    are_numbers = are_numbers && items[k].name == std::to_string(k + 1);
  if (are_numbers || items.size() > kMostNamed) return names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

Json head_of(const Body& body) {
  const Plan& plan = body.plan;
  double size = 0.0;
  for (const PlanPoint& point : plan.points)
    size = std::max(size,
                    std::sqrt(point.r[0] * point.r[0] + point.r[1] * point.r[1] + point.r[2] * point.r[2]));
  Json head{{"name", plan.name},
            {"fingerprint", fingerprint_text(body.fingerprint)},
            {"rate", 1.0 / plan.period},
            {"mass", plan.mass},
            {"size", size},
            {"points", plan.points.size()},
            {"modes", body.num_modes},
            {"allModes", plan.num_elastic},
            {"unknownPoints", body.num_without_shape},
            {"forceLimit", plan.force_limit},
            {"pointNames", names_of(plan.points)},
            {"linkNames", names_of(plan.links)}};
  head["attitude"] = make_state(plan).q_WB;
  if (!plan.fallback.empty()) {
    Json& numbers = head["modeNumbers"] = Json::array();
    for (int l = 0; l < body.num_modes; ++l) numbers.push_back(plan.fallback_modes[index(l)] + 1);
  }
  Json& frequencies = head["frequencies"] = Json::array();
  for (int l = 0; l < body.num_modes; ++l)
    frequencies.push_back(plan.omega[index(l)] / (2.0 * std::numbers::pi));
  Json& groups = head["groups"] = Json::array();
  for (const PlanGroup& group : plan.groups)
    groups.push_back({{"name", group.name}, {"points", group.points}});
  Json& wheels = head["wheels"] = Json::array();
  for (const PlanWheel& wheel : plan.wheels) wheels.push_back(wheel.name);
  Json &links = head["publishedLinks"] = Json::array(), &units = head["loadUnits"] = Json::array();
  for (const PlanLinkOutput& output : plan.link_outputs) {
    links.push_back(output.link);
    units.push_back(traits_of(plan.links[index(output.link)].type).figure_unit);
  }
  return head;
}

void note_links(Body& body) {
  for (const PlanLinkOutput& output : body.plan.link_outputs) body.published_links.push_back(output.link);
}

std::optional<Body> body_of_plan(const std::string& path, const std::string& output,
                                 const io::Settings& settings) {
  std::optional<Plan> plan = load_or_explain(path, 0.0, {output}, settings);
  if (!plan) return std::nullopt;
  Body body;
  body.fingerprint = plan_fingerprint(*plan);
  body.plan_file = path;
  body.plan = std::move(*plan);
  body.num_modes = modes_that_fit(body.plan);
  for (std::size_t k = 0; k < body.plan.links.size(); ++k)
    draw(static_cast<std::uint32_t>(k), traits_of(body.plan.links[k].type).drawing, body.plan.links[k].points,
         body);
  body.num_without_shape = index(std::count_if(body.plan.points.begin(), body.plan.points.end(),
                                               [](const PlanPoint& point) { return point.row < 0; }));
  body.shapes = shapes_of(body.plan, body.num_modes);
  note_links(body);
  return body;
}

std::optional<Body> body_of_scene(const std::string& path, const std::string& output,
                                  const io::Settings& settings) {
  io::SceneResult read = io::read_scene(path, settings);
  for (const std::string& source : read.sources)
    if (would_overwrite(source, output)) return std::nullopt;
  std::optional<Structure> structure;
  std::optional<Plan> plan;
  if (read.scene) {
    Progress progress("setting up " + path);
    structure = build_structure(*read.scene, read.faults, progress.of_setup());
    if (structure) plan = make_plan(*read.scene, *structure, read.faults);
  }
  print_faults(read.faults, read.sources);
  if (!plan) return std::nullopt;
  Body body;
  body.fingerprint = plan_fingerprint(*plan);
  body.plan_file = path;
  body.plan = std::move(*plan);
  body.num_modes = modes_that_fit(body.plan);
  for (std::size_t k = 0; k < body.plan.links.size(); ++k) {
    const Link& link = read.scene->links[k];
    if (const MatrixLink* matrix = matrices_of(link))
      draw(static_cast<std::uint32_t>(k), *matrix, link.points, body);
    else
      draw(static_cast<std::uint32_t>(k), traits_of(body.plan.links[k].type).drawing, link.points, body);
  }
  body.shapes = shapes_of(*structure, body.plan, body.num_modes);
  note_links(body);
  return body;
}

}  // namespace

void Blob::append(const std::string& name, const char* type, std::span<const std::byte> bytes,
                  std::size_t size) {
  arrays_.resize((arrays_.size() + kAlignment - 1) / kAlignment * kAlignment);
  head_["arrays"][name] = {{"type", type}, {"offset", arrays_.size()}, {"length", bytes.size() / size}};
  arrays_.insert(arrays_.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> Blob::finish() const {
  std::string head = json_text(head_);
  // each array begins at a multiple of its alignment
  head.resize((head.size() + 8 + kAlignment - 1) / kAlignment * kAlignment - 8, ' ');
  const auto size = static_cast<std::uint32_t>(head.size());
  std::vector<std::byte> bytes(8 + head.size() + arrays_.size());
  std::memcpy(bytes.data(), "FFV1", 4);
  std::memcpy(bytes.data() + 4, &size, 4);
  std::memcpy(bytes.data() + 8, head.data(), head.size());
  std::copy(arrays_.begin(), arrays_.end(), bytes.begin() + static_cast<std::ptrdiff_t>(8 + head.size()));
  return bytes;
}

std::vector<std::byte> bytes_of(const Body& body) {
  std::vector<float> rest, masses;
  std::vector<std::uint32_t> pushable;
  for (std::size_t i = 0; i < body.plan.points.size(); ++i) {
    const PlanPoint& point = body.plan.points[i];
    for (const double x : point.r) rest.push_back(static_cast<float>(x));
    masses.push_back(static_cast<float>(point.mass));
    if (point.pushable) pushable.push_back(static_cast<std::uint32_t>(i));
  }
  Blob blob(head_of(body));
  blob.add("rest", rest);
  blob.add("masses", masses);
  blob.add("pushable", pushable);
  blob.add("lines", body.lines);
  blob.add("lineLinks", body.line_links);
  blob.add("triangles", body.triangles);
  blob.add("triangleLinks", body.triangle_links);
  blob.add("shapes", body.shapes);
  return blob.finish();
}

std::optional<Body> make_body(const std::string& path, const std::string& output,
                              const io::Settings& settings) {
  return io::is_plan_file(path) ? body_of_plan(path, output, settings)
                                : body_of_scene(path, output, settings);
}

bool take_rate(Body& body, std::uint64_t fingerprint, double rate) {
  if (fingerprint == body.fingerprint) return true;
  if (!std::isfinite(rate) || rate <= 0.0 || rate == 1.0 / body.plan.period) return false;
  Plan plan = body.plan;
  set_rate(plan, rate);
  if (plan_fingerprint(plan) != fingerprint) return false;
  body.fingerprint = fingerprint;
  body.plan = std::move(plan);
  return true;
}

double link_figure(LinkFigure figure, std::span<const double> values) {
  constexpr std::size_t kBeam = 12, kPlate = 6, kTensionOfBeam = 6;
  if (values.empty()) return 0.0;
  if (figure == LinkFigure::kTension && values.size() == kBeam) return values[kTensionOfBeam];
  if (figure == LinkFigure::kMembrane && values.size() == kPlate)
    return std::sqrt(values[0] * values[0] - values[0] * values[1] + values[1] * values[1] +
                     3.0 * values[2] * values[2]);
  if (values.size() == 1) return values[0];
  double largest = 0.0;
  for (std::size_t k = 0; k + 2 < values.size(); k += 3)
    largest = std::max(largest, std::hypot(values[k], values[k + 1], values[k + 2]));
  return largest;
}

}  // namespace freeflex::tools
