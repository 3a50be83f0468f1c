// Each kind of link is read as written.
#include "core/scene/link_kinds.hpp"
#include "tests/scene/good_scene.hpp"

namespace freeflex::testing {
namespace {

const std::string kSixPoints =
    "points:\n"
    "  - {name: a, mass: 1, at: [0, 0, 0]}\n"
    "  - {name: b, mass: 1, at: [1, 0, 0]}\n"
    "  - {name: c, mass: 1, at: [1, 1, 0]}\n"
    "  - {name: d, mass: 1, at: [0, 1, 1]}\n"
    "  - {name: e, mass: 1, at: [0, 2, 0]}\n"
    "  - {name: f, mass: 1, at: [3, 1, 1]}\n";

// returns the links that this text gives for the six points a to f
std::vector<Link> read_links(const std::string& links) {
  return read_good(kSixPoints + "links:\n" + links).links;
}

using Released = std::array<std::array<bool, 3>, 2>;

// these overloads return the text of a link of each kind; if a new kind has no overload, this file does not
// compile
std::string written(const Spring&) { return "{spring: [a, b], stiffness: 1}"; }
std::string written(const Bar&) { return "{bar: [a, b], EA: 1}"; }
std::string written(const Beam&) { return "{beam: [a, b], EA: 1, GJ: 1, EIy: 1, EIz: 1}"; }
std::string written(const MatrixLink&) { return "{matrix: K.mtx, points: [a, b]}"; }
std::string written(const BendingSpring&) { return "{bending: [a, b, c], stiffness: 1}"; }
std::string written(const TorsionSpring&) { return "{torsion: [a, b, c, d], stiffness: 1}"; }
std::string written(const Plate&) { return "{plate: [a, b, c], E: 7e9, nu: 0.3, thickness: 0.01}"; }
std::string written(const Rigid&) { return "{rigid: [a, b]}"; }
std::string written(const Dashpot&) { return "{dashpot: [a, b], damping: 1}"; }

TEST(ReadLinks, TheKeyOfALinkSelectsItsKind) {
  const TemporaryFolder folder;
  folder.write("K.mtx", "%%MatrixMarket matrix coordinate real symmetric\n6 6 3\n1 1 5\n4 1 -5\n4 4 5\n");
  const auto expect = [&]<std::size_t I>(std::integral_constant<std::size_t, I>) {
    const std::variant_alternative_t<I, LinkKind> kind{};
    const std::string text = written(kind);
    EXPECT_EQ(text.rfind("{" + std::string(traits_of(kind).name) + ": ", 0), 0u) << text;
    const auto links = read_good(folder, kSixPoints + "links: [" + text + "]\n").links;
    ASSERT_EQ(links.size(), 1u) << text;
    EXPECT_EQ(links[0].kind.index(), I) << text;
  };
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    (expect(std::integral_constant<std::size_t, I>{}), ...);
  }
  (std::make_index_sequence<std::variant_size_v<LinkKind>>{});
}

TEST(ReadLinks, ABeamHasNoShearDeformationAndNoReleaseByDefault) {
  const auto links = read_links("  - {beam: [a, b, c], EA: 1, GJ: 2, EIy: 3, EIz: 4}\n");
  ASSERT_EQ(links.size(), 2u);
  for (const Link& link : links) {
    const Beam& beam = std::get<Beam>(link.kind);
    EXPECT_EQ(beam.GA_y, 0.0);
    EXPECT_EQ(beam.GA_z, 0.0);
    EXPECT_EQ(beam.released, Released{});
    EXPECT_EQ(link.viscous, 0.0);
    EXPECT_EQ(link.loss_factor, 0.0);
  }
}

TEST(ReadLinks, EachShearKeySetsTheStiffnessAlongItsAxis) {
  const auto links = read_links(
      "  - {beam: [a, b, c], EA: 1, GJ: 2, EIy: 3, EIz: 4, GAy: 5, GAz: 6, loss_factor: 0.25}\n"
      "  - {beam: [c, d], EA: 1, GJ: 2, EIy: 3, EIz: 4, GAz: 7}\n");
  ASSERT_EQ(links.size(), 3u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(std::get<Beam>(links[i].kind).GA_y, 5.0);
    EXPECT_EQ(std::get<Beam>(links[i].kind).GA_z, 6.0);
    EXPECT_EQ(links[i].loss_factor, 0.25);
  }
  EXPECT_EQ(std::get<Beam>(links[2].kind).GA_y, 0.0);
  EXPECT_EQ(std::get<Beam>(links[2].kind).GA_z, 7.0);
}

TEST(ReadLinks, ReleasesActAtTheEndsAndAboutTheAxesThatAreListed) {
  const std::string beam = "  - {beam: [a, b], EA: 1, GJ: 2, EIy: 3, EIz: 4, release: ";
  const auto released = [&](const std::string& release) {
    const auto links = read_links(beam + release + "}\n");
    return links.size() == 1 ? std::get<Beam>(links[0].kind).released : Released{};
  };
  EXPECT_EQ(released("{from: [x, y, z], to: [y, z]}"), (Released{{{true, true, true}, {false, true, true}}}));
  EXPECT_EQ(released("{to: [z, x]}"), (Released{{{false, false, false}, {true, false, true}}}));
  EXPECT_EQ(released("{from: y, to: []}"), (Released{{{false, true, false}, {false, false, false}}}));
}

TEST(ReadLinks, ABendingChainHasASpringForEveryThreeSuccessivePoints) {
  const auto links = read_links(
      "  - {name: one, bending: [c, a, b], stiffness: 2, viscous: 0.25, loss_factor: 0.5}\n"
      "  - {name: more, bending: [a..d], stiffness: 3}\n");
  ASSERT_EQ(links.size(), 3u);
  EXPECT_EQ(links[0].name, "one");
  EXPECT_EQ(links[0].points, (std::vector<int>{2, 0, 1})) << "the middle point stays in the middle";
  EXPECT_EQ(std::get<BendingSpring>(links[0].kind).stiffness, 2.0);
  EXPECT_EQ(links[0].viscous, 0.25);
  EXPECT_EQ(links[0].loss_factor, 0.5);
  EXPECT_EQ(links[1].name, "more.1");
  EXPECT_EQ(links[1].points, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(links[2].name, "more.2");
  EXPECT_EQ(links[2].points, (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(std::get<BendingSpring>(links[2].kind).stiffness, 3.0);
}

TEST(ReadLinks, ATorsionChainAroundARingHasASpringForEachBond) {
  const auto links =
      read_links("  - {torsion: [a..e, a, b, c], stiffness: 4, viscous: 0.5, loss_factor: 0.25}\n");
  ASSERT_EQ(links.size(), 5u);
  const std::vector<std::vector<int>> points{
      {0, 1, 2, 3}, {1, 2, 3, 4}, {2, 3, 4, 0}, {3, 4, 0, 1}, {4, 0, 1, 2}};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(links[i].name, std::to_string(i + 1));
    EXPECT_EQ(links[i].points, points[i]);
    EXPECT_EQ(std::get<TorsionSpring>(links[i].kind).stiffness, 4.0);
    EXPECT_EQ(links[i].viscous, 0.5);
    EXPECT_EQ(links[i].loss_factor, 0.25);
  }
}

TEST(ReadLinks, APlateKeepsItsPointsAndMaterial) {
  const auto links = read_links(
      "  - {name: skin, plate: [f, a, c], E: 7e10, nu: 0.3, thickness: 2e-3, loss_factor: 0.01}\n");
  ASSERT_EQ(links.size(), 1u);
  EXPECT_EQ(links[0].name, "skin");
  EXPECT_EQ(links[0].points, (std::vector<int>{5, 0, 2}));
  const Plate& plate = std::get<Plate>(links[0].kind);
  EXPECT_EQ(plate.E, 7e10);
  EXPECT_EQ(plate.nu, 0.3);
  EXPECT_EQ(plate.thickness, 2e-3);
  EXPECT_EQ(links[0].loss_factor, 0.01);
}

TEST(ReadLinks, ARigidBodyIsOneLinkOverAllSelectedPoints) {
  const auto links =
      read_links("  - {rigid: [b, a]}\n  - {name: body, rigid: [c..e, a]}\n  - {rigid: all}\n");
  ASSERT_EQ(links.size(), 3u);
  for (const Link& link : links) EXPECT_TRUE(std::holds_alternative<Rigid>(link.kind));
  EXPECT_EQ(links[0].points, (std::vector<int>{1, 0}));
  EXPECT_EQ(links[1].points, (std::vector<int>{2, 3, 4, 0}));
  EXPECT_EQ(links[1].name, "body");
  EXPECT_EQ(links[2].points, (std::vector<int>{0, 1, 2, 3, 4, 5}));
}

TEST(ReadLinks, AChainOfDashpotsHasOneDashpotForEachPairOfNeighbours) {
  const auto links = read_links("  - {name: damper, dashpot: [a, b, c], damping: 12.5}\n");
  ASSERT_EQ(links.size(), 2u);
  EXPECT_EQ(links[1].name, "damper.2");
  EXPECT_EQ(links[1].points, (std::vector<int>{1, 2}));
  EXPECT_EQ(std::get<Dashpot>(links[1].kind).damping, 12.5);
}

TEST(ReadLinks, EveryLinkOfAChainHasTheLossesOfTheChain) {
  const auto links = read_links(
      "  - {spring: [a, b, c], stiffness: 1, viscous: 0.5, loss_factor: 0.25}\n"
      "  - {bar: [a, b, c], EA: 1, viscous: 1, loss_factor: 0}\n");
  ASSERT_EQ(links.size(), 4u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(links[i].viscous, 0.5);
    EXPECT_EQ(links[i].loss_factor, 0.25);
    EXPECT_EQ(links[2 + i].viscous, 1.0);
    EXPECT_EQ(links[2 + i].loss_factor, 0.0);
  }
}

// returns which of six links are published; they are spring, rigid link, rigid body, matrix, flexibility and
// dashpot, with the indices 0 to 5
std::vector<int> published_links(const std::string& publish) {
  const TemporaryFolder folder;
  folder.write("K.mtx", "%%MatrixMarket matrix coordinate real symmetric\n6 6 1\n1 1 1\n");
  return read_good(folder, kSixPoints +
                               "links:\n"
                               "  - {name: spring, spring: [a, b], stiffness: 1}\n"
                               "  - {name: rod, rigid: [b, c]}\n"
                               "  - {name: body, rigid: [c..e]}\n"
                               "  - {name: K, matrix: K.mtx, points: [a, b]}\n"
                               "  - {name: F, flexibility: K.mtx, points: [a, b]}\n"
                               "  - {name: damper, dashpot: [a, b], damping: 1}\n" +
                               publish)
      .publication.links;
}

TEST(ReadLinks, LinksWithManyForceComponentsArePublishedOnlyIfListed) {
  const std::vector<int> short_ones{0, 1, 5};
  EXPECT_EQ(published_links(""), short_ones);
  EXPECT_EQ(published_links("publish: {loads: {rate: 10}}\n"), short_ones);
  EXPECT_EQ(published_links("publish: {loads: {of: all}}\n"), short_ones);
  EXPECT_EQ(published_links("publish: {loads: {of: [F, body, K]}}\n"), (std::vector<int>{4, 2, 3}));
  EXPECT_EQ(published_links("publish: {loads: {of: rod..F}}\n"), (std::vector<int>{1, 2, 3, 4}));
  EXPECT_EQ(published_links("publish: {loads: {of: []}}\n"), std::vector<int>{});
}

TEST(ReadLinks, ASceneWithEveryKindOfLinkBecomesAPlanWithoutFaults) {
  const TemporaryFolder folder;
  folder.write("K.mtx", "%%MatrixMarket matrix coordinate real symmetric\n6 6 3\n1 1 5\n4 1 -5\n4 4 5\n");
  std::string flexibility = "%%MatrixMarket matrix coordinate real symmetric\n6 6 6\n";
  for (int i = 1; i <= 6; ++i) flexibility += std::to_string(i) + " " + std::to_string(i) + " 1e-4\n";
  folder.write("F.mtx", flexibility);
  folder.write(
      "scene.yaml",
      kSixPoints +
          "links:\n"
          "  - {beam: [a, b], EA: 1e6, GJ: 1e3, EIy: 1e3, EIz: 1e3, GAy: 1e5, release: {to: [y, z]}}\n"
          "  - {name: s, spring: [a, c, f, b, d, e, f, d], stiffness: 1e4, viscous: 1e-4}\n"
          "  - {bar: [a, e], EA: 1e5, loss_factor: 0.01}\n"
          "  - {bending: [b, c, e], stiffness: 100}\n"
          "  - {torsion: [a, b, c, d], stiffness: 100}\n"
          "  - {plate: [c, d, e], E: 7e10, nu: 0.3, thickness: 1e-3}\n"
          "  - {rigid: [a, d]}\n"
          "  - {dashpot: [a, f], damping: 3}\n"
          "  - {name: K, matrix: K.mtx, points: [a, b]}\n"
          "  - {name: F, flexibility: F.mtx, points: [c, f]}\n"
          "feedback: {at: f, velocity: -1}\n"
          "attractor: {at: [7e6, 0, 0], mu: 3.986e14}\n"
          "fidelity: spin-loaded\n"
          "loads: {axes: local, forces: {b: [0, 0, 1]}, pulse: {duration: 0.1}}\n");
  const io::PlanResult result = io::load_plan("scene.yaml");
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  ASSERT_TRUE(result.plan.has_value());
  EXPECT_EQ(result.plan->num_elastic, 3 * 6 - 6 - 1) << "the rigid link removes one freedom";
  EXPECT_EQ(result.plan->links.size(), 16u);
  EXPECT_EQ(result.plan->link_outputs.size(), 14u) << "all links except the two matrices";
}

}  // namespace
}  // namespace freeflex::testing
