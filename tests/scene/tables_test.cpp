// CSV and Matrix Market files mean what their formats say.
#include <gtest/gtest.h>

#include "service/io/input.hpp"
#include "tests/scene/temporary_folder.hpp"

namespace freeflex::testing {
namespace {

Scene read_good(const TemporaryFolder& folder, const std::string& text) {
  folder.write("scene.yaml", text);
  const io::SceneResult result = io::read_scene("scene.yaml");
  for (const Fault& fault : result.faults) ADD_FAILURE() << io::format_fault(fault, result.sources);
  return result.scene.value_or(Scene{});
}

TEST(Csv, ColumnsStandInAnyOrderWithCommentsBlanksAndCrLf) {
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

TEST(Csv, HeaderGivesTheKindOfLink) {
  const TemporaryFolder folder;
  folder.write("points.csv", "mass,x,y,z\n1,0,0,0\n1,1,0,0\n1,0,1,0\n");
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
  EXPECT_EQ(scene.links[1].points, (std::array<int, 2>{1, 2}));
  EXPECT_EQ(std::get<Bar>(scene.links[1].kind).EA, 6.0);
  const Beam& beam = std::get<Beam>(scene.links[2].kind);
  EXPECT_EQ(std::vector<double>({beam.EA, beam.GJ, beam.EI_y, beam.EI_z}),
            std::vector<double>({7, 8, 9, 10}));
  EXPECT_EQ(scene.links[4].name, "5");
}

class MatrixMarket : public ::testing::Test {
 protected:
  // the matrix that K.mtx gives for two points
  Eigen::MatrixXd read(const std::string& text) {
    folder_.write("K.mtx", text);
    const Scene scene =
        read_good(folder_,
                  "points: [{name: a, mass: 1, at: [0, 0, 0]}, {name: b, mass: 1, at: [1, 0, 0]}]\n"
                  "links: {matrix: K.mtx, points: [b, a]}\n");
    if (scene.links.size() != 1) return {};
    const MatrixLink& link = std::get<MatrixLink>(scene.links[0].kind);
    EXPECT_EQ(link.points, (std::vector<int>{1, 0}));
    return link.stiffness;
  }
  TemporaryFolder folder_;
};

Eigen::MatrixXd spring_along_x(double stiffness) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(6, 6);
  matrix(0, 0) = matrix(3, 3) = stiffness;
  matrix(0, 3) = matrix(3, 0) = -stiffness;
  return matrix;
}

TEST_F(MatrixMarket, SymmetricCoordinatesAreMirrored) {
  EXPECT_EQ(
      read("%%MatrixMarket matrix coordinate real symmetric\n% [N/m]\n\n6 6 3\n1 1 5e0\n4 1 -5\n\n4 4 5.0\n"),
      spring_along_x(5));
}

TEST_F(MatrixMarket, GeneralCoordinatesHoldBothTriangles) {
  EXPECT_EQ(read("%%matrixmarket MATRIX Coordinate Integer General\r\n6 6 4\r\n4 1 -5\r\n1 1 5\r\n1 4 "
                 "-5\r\n4 4 5\r\n"),
            spring_along_x(5));
}

TEST_F(MatrixMarket, RoundedGeneralMatrixIsAveraged) {
  const Eigen::MatrixXd matrix =
      read("%%MatrixMarket matrix coordinate real general\n6 6 4\n1 1 1\n4 1 -0.9999999996\n1 4 -1\n4 4 1\n");
  ASSERT_EQ(matrix.rows(), 6);
  EXPECT_EQ(matrix(0, 3), matrix(3, 0));
  EXPECT_DOUBLE_EQ(matrix(0, 3), -0.9999999998);
}

TEST_F(MatrixMarket, ArraysRunDownTheColumns) {
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
