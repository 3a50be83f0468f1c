// The data from which the page draws a structure: positions, lines, triangles and mode shapes. They are sent
// once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/faults.hpp"
#include "core/plan.hpp"
#include "core/structure/structure.hpp"
#include "tools/terminal/console.hpp"
#include "tools/terminal/json.hpp"

namespace freeflex::tools {

/// Builds the bytes of a JSON head and arrays that the page reads (page/blob.js): "FFV1", length of the head
/// [uint32], the head, and each array at a multiple of eight bytes. All numbers are little-endian. `arrays`
/// in the head lists the type (f32, f64, u32), offset and length of each array.
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

/// A structure in the form in which it is drawn.
struct Body {
  std::uint64_t fingerprint = 0;  // fingerprint of the plan whose motion is shown
  std::string plan_file;
  Plan plan;          // if read from a plan file, only points with stored mode shapes move
  int num_modes = 0;  // number of lowest modes whose shapes are sent
  std::vector<std::uint32_t> lines, line_links;          // pairs of points; the link of each line
  std::vector<std::uint32_t> triangles, triangle_links;  // triangles and their links
  std::vector<float> shapes;                             // [-] (3 x points x modes)
  std::size_t num_without_shape = 0;          // number of points of a plan file that have no mode shapes
  std::vector<std::int32_t> published_links;  // published links in the order of LOADS
};
/// Returns the body as a Blob.
std::vector<std::byte> bytes_of(const Body& body);

/// [bytes] Limit of the size of the mode shapes. For larger bodies the page draws only the lowest modes, and
/// reports this.
inline constexpr std::size_t kMostShapeBytes = std::size_t{128} << 20;

/// Makes the body from a scene, with the mode shapes at all points, or from a plan file, with the mode shapes
/// that it contains. On failure, prints an error on stderr and returns nullopt.
/// \param output    file that will be written afterwards; it must not be one of the files that are read
/// \param settings  replace values of the scene
std::optional<Body> make_body(const std::string& path, const std::string& output = {},
                              const io::Settings& settings = {});

/// Returns true if a fingerprint is that of the body's plan, at the body's rate or at `rate` [Hz]. In the
/// second case, sets `rate` in the body.
bool take_rate(Body& body, std::uint64_t fingerprint, double rate);

/// Returns the value that determines the colour of a link: the tension [N] or the moment [N m]; for a plate,
/// the von Mises stress in its plane times its thickness [N/m]; for matrices and rigid bodies the largest
/// force on a point [N].
double link_figure(LinkFigure figure, std::span<const double> values);

}  // namespace freeflex::tools
