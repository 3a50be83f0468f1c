// CSV and Matrix Market files are read as their formats define.
#include <gtest/gtest.h>

#include "tests/scene/good_scene.hpp"

namespace freeflex::testing {
namespace {

const std::string kThreeRows = "mass,x,y,z\n1,0,0,0\n1,1,0,0\n1,0,1,0\n";

TEST(Csv, ColumnsMayBeInAnyOrderWithCommentsBlanksAndCrLf) {
  const TemporaryFolder folder;
  folder.write(
      "points.csv",
      "\xef\xbb\xbf# made by hand\r\n z , mass,x,name,y\r\n\r\n3,1e1, 1 ,a,2\r\n# b\r\n-3,.5,-1,b,-2");
  const Scene scene = read_good(folder, "points: {csv: points.csv}\n");
  ASSERT_EQ(scene.points.size(), 2u);
  EXPECT_EQ(scene.points[0].name, "a");
  EXPECT_EQ(scene.points[0].mass, 10.0);
  EXPECT_EQ(scene.points[0].position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(scene.points[1].name, "b");
  EXPECT_EQ(scene.points[1].position, Eigen::Vector3d(-1, -2, -3));
  EXPECT_EQ(scene.points[1].origin.source, 1);
  EXPECT_EQ(scene.points[1].origin.line, 6);
}

TEST(Csv, TheHeaderOfATableGivesTheKindOfItsLinks) {
  const TemporaryFolder folder;
  folder.write("points.csv", kThreeRows);
  folder.write("springs.csv", "from,to,stiffness\n1,2,5\n");
  folder.write("bars.csv", "name,to,from,EA\nbar,3,2,6\n");
  folder.write("beams.csv", "from,to,EA,GJ,EIy,EIz\n1,3,7,8,9,10\n");
  const Scene scene = read_good(
      folder,
      "points: {csv: points.csv}\n"
      "links: [{csv: springs.csv}, {csv: bars.csv}, {csv: beams.csv}, {bar: ['1', '2', '3'], EA: 1}]\n");
  ASSERT_EQ(scene.links.size(), 5u);
  EXPECT_EQ(std::get<Spring>(scene.links[0].kind).stiffness, 5.0);
  EXPECT_EQ(scene.links[1].name, "bar");
  EXPECT_EQ(scene.links[1].points, (std::vector<int>{1, 2}));
  EXPECT_EQ(std::get<Bar>(scene.links[1].kind).EA, 6.0);
  const Beam& beam = std::get<Beam>(scene.links[2].kind);
  EXPECT_EQ(std::vector<double>({beam.EA, beam.GJ, beam.EI_y, beam.EI_z}),
            std::vector<double>({7, 8, 9, 10}));
  EXPECT_EQ(scene.links[4].name, "5");
}

TEST(Csv, BeamsMayHaveShearStiffnessAndALossFactor) {
  const TemporaryFolder folder;
  folder.write("points.csv", kThreeRows);
  folder.write("both.csv", "loss_factor,GAz,GAy,from,to,EA,GJ,EIy,EIz\n0.5,12,11,1,3,7,8,9,10\n");
  folder.write("one.csv", "# a comment\nfrom,to,EA,GJ,EIy,EIz,GAz\n1,2,7,8,9,10,13\n");
  const Scene scene =
      read_good(folder, "points: {csv: points.csv}\nlinks: [{csv: both.csv}, {csv: one.csv}]\n");
  ASSERT_EQ(scene.links.size(), 2u);
  const Beam& both = std::get<Beam>(scene.links[0].kind);
  EXPECT_EQ(both.GA_y, 11.0);
  EXPECT_EQ(both.GA_z, 12.0);
  EXPECT_EQ(both.EI_z, 10.0);
  EXPECT_EQ(scene.links[0].loss_factor, 0.5);
  const Beam& one = std::get<Beam>(scene.links[1].kind);
  EXPECT_EQ(one.GA_y, 0.0) << "no shear deformation along y";
  EXPECT_EQ(one.GA_z, 13.0);
  EXPECT_EQ(scene.links[1].loss_factor, 0.0);
}

TEST(Csv, SpringsAndBarsMayHaveLosses) {
  const TemporaryFolder folder;
  folder.write("points.csv", kThreeRows);
  folder.write("springs.csv", "from,to,stiffness,viscous,loss_factor\n1,2,5,0.25,0.5\n2,3,6,0,0\n");
  folder.write("bars.csv", "from,to,EA,viscous\n1,3,7,1e-3\n");
  const Scene scene =
      read_good(folder, "points: {csv: points.csv}\nlinks: [{csv: springs.csv}, {csv: bars.csv}]\n");
  ASSERT_EQ(scene.links.size(), 3u);
  EXPECT_EQ(scene.links[0].viscous, 0.25);
  EXPECT_EQ(scene.links[0].loss_factor, 0.5);
  EXPECT_EQ(scene.links[1].viscous, 0.0);
  EXPECT_EQ(scene.links[1].loss_factor, 0.0);
  EXPECT_EQ(std::get<Bar>(scene.links[2].kind).EA, 7.0);
  EXPECT_EQ(scene.links[2].viscous, 1e-3);
}

TEST(Csv, DashpotsAndPlatesHaveTheirOwnColumns) {
  const TemporaryFolder folder;
  folder.write("points.csv", kThreeRows);
  folder.write("dashpots.csv", "from,to,damping\n1,2,5\n");
  folder.write("plates.csv", "from,to,third,E,nu,thickness,loss_factor\n3,1,2,7e10,-0.25,0.01,0.5\n");
  const Scene scene =
      read_good(folder, "points: {csv: points.csv}\nlinks: [{csv: dashpots.csv}, {csv: plates.csv}]\n");
  ASSERT_EQ(scene.links.size(), 2u);
  EXPECT_EQ(std::get<Dashpot>(scene.links[0].kind).damping, 5.0);
  EXPECT_EQ(scene.links[0].points, (std::vector<int>{0, 1}));
  const Plate& plate = std::get<Plate>(scene.links[1].kind);
  EXPECT_EQ(plate.E, 7e10);
  EXPECT_EQ(plate.nu, -0.25);
  EXPECT_EQ(plate.thickness, 0.01);
  EXPECT_EQ(scene.links[1].points, (std::vector<int>{2, 0, 1}));
  EXPECT_EQ(scene.links[1].loss_factor, 0.5);
}

class MatrixMarket : public ::testing::Test {
 protected:
  // returns the stiffness matrix of two points from the text of K.mtx
  Eigen::MatrixXd read(const std::string& text) {
    folder_.write("K.mtx", text);
    const Scene scene =
        read_good(folder_,
                  "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
                  "links: {matrix: K.mtx, points: [b, a]}\n");
    if (scene.links.size() != 1) return {};
    EXPECT_EQ(scene.links[0].points, (std::vector<int>{1, 0}));
    const auto& link = std::get<MatrixLink>(scene.links[0].kind);
    EXPECT_FALSE(link.is_flexibility);
    return link.matrix;
  }
  TemporaryFolder folder_;
};

Eigen::MatrixXd spring_along_x(double stiffness) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(6, 6);
  matrix(0, 0) = matrix(3, 3) = stiffness;
  matrix(0, 3) = matrix(3, 0) = -stiffness;
  return matrix;
}

TEST_F(MatrixMarket, ASymmetricCoordinateFileGivesBothTriangles) {
  EXPECT_EQ(
      read("%%MatrixMarket matrix coordinate real symmetric\n% [N/m]\n\n6 6 3\n1 1 5e0\n4 1 -5\n\n4 4 5.0\n"),
      spring_along_x(5));
}

TEST_F(MatrixMarket, AGeneralCoordinateFileListsBothTriangles) {
  EXPECT_EQ(read("%%matrixmarket MATRIX Coordinate Integer General\r\n6 6 4\r\n4 1 -5\r\n1 1 5\r\n1 4 "
                 "-5\r\n4 4 5\r\n"),
            spring_along_x(5));
}

TEST_F(MatrixMarket, AGeneralMatrixWithRoundedEntriesIsAveragedWithItsTranspose) {
  const Eigen::MatrixXd matrix =
      read("%%MatrixMarket matrix coordinate real general\n6 6 4\n1 1 1\n4 1 -0.9999999996\n1 4 -1\n4 4 1\n");
  ASSERT_EQ(matrix.rows(), 6);
  EXPECT_EQ(matrix(0, 3), matrix(3, 0));
  EXPECT_DOUBLE_EQ(matrix(0, 3), -0.9999999998);
}

// an asymmetry of 9e-7 of the largest entry, which can result from rounding to seven digits, is removed by
// averaging, but an asymmetry of 1.1e-6 is refused
TEST_F(MatrixMarket, AnAsymmetryFromRoundingToSevenDigitsIsAccepted) {
  const auto load = [&](const std::string& entry) {
    folder_.write("K.mtx", "%%MatrixMarket matrix coordinate real general\n6 6 4\n1 1 1\n4 1 " + entry +
                               "\n1 4 -1\n4 4 1\n");
    folder_.write("scene.yaml",
                  "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
                  "links: {matrix: K.mtx, points: [a, b]}\n");
    return io::load_plan("scene.yaml");
  };
  const io::PlanResult taken = load("-0.9999991");
  ASSERT_TRUE(taken.plan);
  EXPECT_NEAR(taken.plan->omega[0], std::sqrt(2.0), 1e-6);
  const io::PlanResult refused = load("-0.9999989");
  EXPECT_FALSE(refused.plan);
  ASSERT_EQ(refused.faults.size(), 1u);
  EXPECT_NE(refused.faults[0].message.find("may differ by at most 1e-06 of the largest entry"),
            std::string::npos)
      << refused.faults[0].message;
}

TEST_F(MatrixMarket, AFlexibilityMatrixIsReadLikeAStiffnessMatrix) {
  folder_.write("F.mtx",
                "%%MatrixMarket matrix coordinate real symmetric\n% [m/N]\n6 6 2\n1 1 2e-6\n4 1 -1e-6\n");
  const Scene scene =
      read_good(folder_,
                "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
                "links: {name: body, flexibility: F.mtx, points: [b, a], viscous: 0.25, loss_factor: 0.5}\n");
  ASSERT_EQ(scene.links.size(), 1u);
  const auto& link = std::get<MatrixLink>(scene.links[0].kind);
  EXPECT_TRUE(link.is_flexibility);
  EXPECT_EQ(scene.links[0].points, (std::vector<int>{1, 0}));
  EXPECT_EQ(scene.links[0].viscous, 0.25);
  EXPECT_EQ(scene.links[0].loss_factor, 0.5);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(6, 6);
  expected(0, 0) = 2e-6;
  expected(0, 3) = expected(3, 0) = -1e-6;
  EXPECT_EQ(link.matrix.toDense(), expected);
}

TEST_F(MatrixMarket, AnArrayFileListsItsEntriesColumnByColumn) {
  const Eigen::MatrixXd expected = [] {
    Eigen::MatrixXd matrix(6, 6);
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column < 6; ++column)
        matrix(row, column) = 10 * std::max(row, column) + std::min(row, column);
    return matrix;
  }();
  std::string general = "%%MatrixMarket matrix array real general\n6 6\n";
  std::string symmetric = "%%MatrixMarket matrix array integer symmetric\n6 6\n";
  for (int column = 0; column < 6; ++column)
    for (int row = 0; row < 6; ++row) {
      const std::string line = std::to_string(static_cast<int>(expected(row, column))) + "\n";
      general += line;
      if (row >= column) symmetric += line;
    }
  EXPECT_EQ(read(general), expected);
  EXPECT_EQ(read(symmetric), expected);
}

}  // namespace
}  // namespace freeflex::testing
