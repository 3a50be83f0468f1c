// What a page needs to draw a structure: places, lines, triangles and mode shapes, sent once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/scene/faults.hpp"
#include "core/step/plan.hpp"
#include "core/structure/structure.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"

namespace freeflex::tools {

/// Bytes of a JSON head and arrays behind it, as the page reads them (page/blob.js): "FFV1", length of the
/// head [uint32], the head, and each array at a multiple of eight bytes; little-endian. The head's `arrays`
/// has of each type (f32, f64, u32), offset and length.
class Blob {
 public:
  explicit Blob(Json head) : head_(std::move(head)) {}
  void add(const std::string& name, std::span<const float> values) {
    append(name, "f32", std::as_bytes(values), 4);
  }
  void add(const std::string& name, std::span<const double> values) {
    append(name, "f64", std::as_bytes(values), 8);
  }
  void add(const std::string& name, std::span<const std::uint32_t> values) {
    append(name, "u32", std::as_bytes(values), 4);
  }
  std::vector<std::byte> finish() const;

 private:
  void append(const std::string& name, const char* type, std::span<const std::byte> bytes, std::size_t size);

  Json head_;
  std::vector<std::byte> arrays_;
};

/// A structure as it is drawn.
struct Body {
  std::uint64_t fingerprint = 0;  // of the plan that moves it
  std::string plan_file;
  Plan plan;          // without a scene: what of the points the plan has rows of moves
  int num_modes = 0;  // whose shapes are here: the lowest
  std::vector<std::uint32_t> lines, line_links;          // pairs of points, the link of each line
  std::vector<std::uint32_t> triangles, triangle_links;  // of plates
  std::vector<float> shapes;                             // [-] (3 x points x modes)
  std::size_t num_still = 0;                             // points without a shape, of a plan file
  std::vector<std::int32_t> published_links;             // in the order of LOADS
};
/// A Blob of it.
std::vector<std::byte> bytes_of(const Body& body);

/// [bytes] Shapes beyond that are not sent: the page then draws the lowest modes alone, and says so.
inline constexpr std::size_t kMostShapeBytes = std::size_t{128} << 20;

/// Of a scene, with the shapes of all points, or of a plan file, with those that it has. Empty, explained on
/// stderr.
/// \param output  that is written afterwards: it may be nothing that is read
std::optional<Body> make_body(const std::string& path, const std::string& output = {});

/// True when a daemon's plan is this one, at the rate [Hz] at which it runs: the body then has that rate.
bool take_rate(Body& body, std::uint64_t fingerprint, double rate);

/// The one figure of a link's forces that colours it: tension [N], moment [N m], of a plate the stress in its
/// plane by von Mises times its thickness [N/m], of matrices and rigid bodies the largest force on a point
/// [N].
double link_figure(const std::string& kind, std::span<const double> values);
/// Unit of that figure.
const char* figure_unit(const std::string& kind);

}  // namespace freeflex::tools
