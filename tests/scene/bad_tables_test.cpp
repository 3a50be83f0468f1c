// The scenes in these tests are refused for their Matrix Market and CSV files, and for files that cannot be
// read.
#include "tests/scene/bad_scene.hpp"

namespace freeflex::testing {
namespace {

class Matrix : public ::testing::TestWithParam<BadScene> {};

TEST_P(Matrix, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Matrix,
    ::testing::Values(
        BadScene{"NotMatrixMarket",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx",
                   "6 6 3\n"
                   "1 1 5\n"}},
                 {"K.mtx:1:1: error: this is not a Matrix Market file; the first line must be %%MatrixMarket "
                  "matrix coordinate|array real|integer symmetric|general"}},
        BadScene{"ComplexHermitian",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx",
                   "%%MatrixMarket matrix coordinate complex hermitian\n"
                   "6 6 0\n"}},
                 {"K.mtx:1:34: error: 'complex' is not supported; it must be real or integer",
                  "K.mtx:1:42: error: 'hermitian' is not supported; it must be symmetric or general"}},
        BadScene{"WrongSize",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "% comment\n"
                                            "9 9 1\n"
                                            "1 1 5\n"}},
                 {"K.mtx:3:1: error: the stiffness matrix is 9 x 9, but must be 6 x 6 (3 rows for each of 2 "
                  "points)"}},
        BadScene{"IndexOutside",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 2\n"
                                            "7 1 5\n"
                                            "0 1 5\n"}},
                 {"K.mtx:3:1: error: the row is '7', but must be a whole number from 1 to 6",
                  "K.mtx:4:1: error: the row is '0', but must be a whole number from 1 to 6"}},
        BadScene{"TooFewEntries",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 4\n"
                                            "1 1 5\n"
                                            "4 1 -5\n"
                                            "4 4 5\n"}},
                 {"K.mtx:5:1: error: the file ends after 3 entries, but the size line gives 4"}},
        BadScene{"TooManyEntries",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 1\n"
                                            "1 1 5\n"
                                            "4 4 5\n"}},
                 {"K.mtx:4:1: error: there are more entries than the 1 that the size line gives"}},
        BadScene{"NotFinite",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 2\r\n"
                                            "1 1 nan\r\n"
                                            "4 4 1e999\r\n"}},
                 {"K.mtx:3:5: error: stiffness 'nan' is not finite, but must be a number [N/m]",
                  "K.mtx:4:5: error: stiffness '1e999' is too large or too small for a double, but must be a "
                  "number [N/m]"}},
        BadScene{"DecimalComma",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 2\n"
                                            "1 1 1,5\n"
                                            "4 4 -,5e3\n"}},
                 {"K.mtx:3:5: error: stiffness '1,5' has a comma, but must be a number with a decimal point; "
                  "write 1.5",
                  "K.mtx:4:5: error: stiffness '-,5e3' has a comma, but must be a number with a decimal "
                  "point; write -.5e3"}},
        BadScene{"EntryTwice",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 3\n"
                                            "1 1 5\n"
                                            "4 4 5\n"
                                            "1 1 5\n"}},
                 {"K.mtx:5:1: error: row 1, column 1 is given twice, first on line 3; remove one"}},
        BadScene{"AboveTheDiagonal",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 1\n"
                                            "1 4 5\n"}},
                 {"K.mtx:3:1: error: row 1, column 4 is above the diagonal, but a symmetric file holds the "
                  "lower triangle only"}},
        BadScene{"NotSymmetric",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx",
                   "%%MatrixMarket matrix coordinate integer general\n"
                   "6 6 4\n"
                   "1 1 5\n"
                   "1 4 -5\n"
                   "4 1 -4\n"
                   "4 4 5\n"}},
                 {"K.mtx:5:1: error: the stiffness matrix is not symmetric. Row 4, column 1 is -4 and its "
                  "mirror is -5, but they may differ by at most 1e-06 of the largest entry; correct one, or "
                  "write their mean in both"}},
        BadScene{"EntryOfTwoWords",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 1\n"
                                            "1 1\n"}},
                 {"K.mtx:3:1: error: an entry must be row, column and value"}},
        BadScene{"ArrayTooShort",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx",
                   "%%MatrixMarket matrix array real general\n"
                   "6 6\n"
                   "1\n"
                   "2\n"}},
                 {"K.mtx:4:1: error: the file ends after 2 entries, but the size line gives 36"}},
        BadScene{"Indefinite",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 3\n"
                                            "1 1 -5\n"
                                            "4 1 5\n"
                                            "4 4 -5\n"}},
                 {"scene.yaml:5:5: error: link 'body': the stiffness matrix is not positive semidefinite. "
                  "Its least eigenvalue is -10 N/m and its largest 10 N/m, but the least must be at least "
                  "-1e-06 times the largest, because such a link would release an unlimited amount of "
                  "energy; check the signs of its entries"}},
        BadScene{"NotFree",
                 {{"scene.yaml", kMatrixScene},
                  {"K.mtx", kMatrixHeader + "6 6 1\n"
                                            "1 1 5\n"}},
                 {"scene.yaml:5:5: error: link 'body': the stiffness matrix resists rigid motion of its "
                  "points. |K u| / (|K| |u|) is 1 for one motion u, but may be at most 1e-05, because a free "
                  "structure has no link to ground; check supports, units and the order of points"}}),
    bad_scene_name);

class Csv : public ::testing::TestWithParam<BadScene> {};

TEST_P(Csv, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Csv,
    ::testing::Values(
        BadScene{"UnknownColumn",
                 {{"scene.yaml", "points: {csv: points.csv}\n"},
                  {"points.csv",
                   "name,mas,x,y,z\n"
                   "a,1,0,0,0\n"}},
                 {"points.csv:1:6: error: the column 'mas' is unknown (did you mean 'mass'?); allowed are "
                  "name, mass, x, y, z"}},
        BadScene{"MissingColumn",
                 {{"scene.yaml", "points: {csv: points.csv}\n"},
                  {"points.csv",
                   "# points\n"
                   "name,mass,x,y\n"
                   "a,1,0,0\n"}},
                 {"points.csv:2:1: error: the header has no column z; commas must separate the names in the "
                  "header"}},
        BadScene{"ColumnTwice",
                 {{"scene.yaml", "points: {csv: points.csv}\n"},
                  {"points.csv",
                   "name,mass,x,y,z,x\n"
                   "a,1,0,0,0,0\n"}},
                 {"points.csv:1:17: error: column 'x' appears twice; remove one"}},
        BadScene{"ShortRow",
                 {{"scene.yaml", "points: {csv: points.csv}\n"},
                  {"points.csv",
                   "name,mass,x,y,z\n"
                   "\n"
                   "a,1,0,0\n"
                   "b,1,1,0,0,7\n"}},
                 {"points.csv:3:1: error: row 1 has 4 fields, but the header has 5 (name, mass, x, y, z)",
                  "points.csv:4:1: error: row 2 has 6 fields, but the header has 5 (name, mass, x, y, z); a "
                  "comma separates fields, so write decimals with a point"}},
        BadScene{
            "BadNumbers",
            {{"scene.yaml", "points: {csv: points.csv}\n"},
             {"points.csv",
              "name,mass,x,y,z\r\n"
              "a, heavy,0,,0\r\n"
              "b,1,1 mm,0, 1e\r\n"}},
            {"points.csv:2:4: error: point 'a': mass 'heavy' is not a number, but must be a number >= 0 [kg]",
             "points.csv:2:12: error: point 'a': y is empty, but must be a number [m]",
             "points.csv:3:5: error: point 'b': x '1 mm' has a unit, but must be a plain number in SI units "
             "[m]; write 0.001",
             "points.csv:3:13: error: point 'b': z '1e' is not a number, but must be a number [m], in SI "
             "without a unit"}},
        BadScene{"Semicolons",
                 {{"scene.yaml", "points: {csv: points.csv}\n"},
                  {"points.csv",
                   "name;mass;x;y;z\n"
                   "a;1;0;0;0\n"}},
                 {"points.csv:1:1: error: the column 'name;mass;x;y;z' is unknown; allowed are name, mass, "
                  "x, y, z",
                  "points.csv:1:1: error: the header has no column mass, x, y, z; commas must separate the "
                  "names in the header"}},
        BadScene{"Empty",
                 {{"scene.yaml", "points: {csv: points.csv}\n"}, {"points.csv", "\n"}},
                 {"points.csv:1:1: error: the table is empty; its first line must name the columns name, "
                  "mass, x, y, z"}},
        BadScene{
            "Quotes",
            {{"scene.yaml", "points: {csv: points.csv}\n"},
             {"points.csv",
              "name,mass,x,y,z\n"
              "\"a\",1,0,0,0\n"}},
            {"points.csv:2:1: error: point in row 1: name '\"a\"' must be 1 to 63 of A-Z a-z 0-9 _ . -"}},
        BadScene{"PhysicsOfARowWithoutAName",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1, at: [0, 0, 0]}\n"
                   "  - {name: b, mass: 1, at: [0, 0, 0]}\n"
                   "  - {name: c, mass: 1, at: [1, 0, 0]}\n"
                   "links: [{spring: [a, c, b], stiffness: 1}, {csv: links.csv}]\n"},
                  {"links.csv",
                   "from,to,stiffness\n"
                   "a,c,5\n"
                   "a,b,5\n"}},
                 {"links.csv:3:1: error: link in row 2 joins 'a', 'b', which are in one place, but a link "
                  "needs a length > 0; move a point or remove the link"}},
        BadScene{"RowsWithoutAName",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1, at: [5, 0, 0]}\n"
                   "  - {csv: points.csv}\n"
                   "  - {mass: -2, at: [6, 0, 0]}\n"},
                  {"points.csv",
                   "mass,x,y,z\n"
                   "1,0,0\n"
                   "# a comment is no row\n"
                   "1,0\n"
                   "-1,0,0,0\n"
                   "1,5,0,0,0\n"}},
                 {"scene.yaml:4:12: error: point 3: mass is -2 kg, but must be >= 0",
                  "points.csv:2:1: error: row 1 has 3 fields, but the header has 4 (mass, x, y, z)",
                  "points.csv:4:1: error: row 2 has 2 fields, but the header has 4 (mass, x, y, z)",
                  "points.csv:5:1: error: point in row 3: mass is -1 kg, but must be >= 0",
                  "points.csv:6:1: error: row 4 has 5 fields, but the header has 4 (mass, x, y, z); a comma "
                  "separates fields, so write decimals with a point"}},
        BadScene{"RowWithABadName",
                 {{"scene.yaml", "points: {csv: points.csv}\n"},
                  {"points.csv",
                   "name,mass,x,y,z\n"
                   "a,1,0,0,0\n"
                   ",-1,1,0,0\n"
                   "c d,-1,1,0,0\n"}},
                 {"points.csv:3:1: error: point in row 2: name '' must be 1 to 63 of A-Z a-z 0-9 _ . -",
                  "points.csv:3:2: error: point in row 2: mass is -1 kg, but must be >= 0",
                  "points.csv:4:1: error: point in row 3: name 'c d' must be 1 to 63 of A-Z a-z 0-9 _ . -",
                  "points.csv:4:5: error: point in row 3: mass is -1 kg, but must be >= 0"}},
        BadScene{"PointTwiceAcrossFiles",
                 {{"scene.yaml",
                   "points:\n"
                   "  - {name: a, mass: 1, at: [5, 0, 0]}\n"
                   "  - {csv: points.csv}\n"},
                  {"points.csv",
                   "name,mass,x,y,z\n"
                   "a,1,0,0,0\n"
                   "b,1,1,0,0\n"}},
                 {"points.csv:2:1: error: point 'a' is defined twice, first at scene.yaml:2:5; give each "
                  "point a name of its own"}},
        BadScene{
            "UnknownEnd",
            {{"scene.yaml",
              "points: {csv: points.csv}\n"
              "links: {csv: links.csv}\n"},
             {"points.csv",
              "name,mass,x,y,z\n"
              "a,1,0,0,0\n"
              "b,1,1,0,0\n"},
             {"links.csv",
              "from,to,stiffness\n"
              "a,c,10\n"
              "b,b,10\n"}},
            {"links.csv:2:3: error: link in row 1: to names the point 'c', which the scene does not have; it "
             "has a, b",
             "links.csv:3:3: error: link in row 2 joins the point 'b' to itself; give two different points"}},
        BadScene{"NoKindOfLink",
                 {{"scene.yaml",
                   "points: {csv: points.csv}\n"
                   "links: {csv: links.csv}\n"},
                  {"points.csv",
                   "name,mass,x,y,z\n"
                   "a,1,0,0,0\n"
                   "b,1,1,0,0\n"},
                  {"links.csv",
                   "from,to,GJ\n"
                   "a,b,10\n"}},
                 {"links.csv:1:1: error: the columns do not give a kind of link; in addition to from and "
                  "to there must be stiffness (for springs); EA and optionally mass_per_length (for bars); "
                  "EA, GJ, EIy, EIz and optionally GAy, GAz, mass_per_length (for beams); damping (for "
                  "dashpots); or third, E, nu, thickness and optionally density (for plates)"}}),
    bad_scene_name);

class LinkTable : public ::testing::TestWithParam<BadScene> {};

TEST_P(LinkTable, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

// returns a scene of the points a, b, c whose links are in this table
BadScene bad_links(const std::string& name, const std::string& table, std::vector<std::string> messages) {
  return {name,
          {{"scene.yaml", "points: {csv: points.csv}\nlinks: {csv: links.csv}\n"},
           {"points.csv", "name,mass,x,y,z\na,1,0,0,0\nb,1,1,0,0\nc,1,0,1,0\n"},
           {"links.csv", table}},
          std::move(messages)};
}

INSTANTIATE_TEST_SUITE_P(
    BadScene, LinkTable,
    ::testing::Values(
        bad_links("ShearStiffnessOfASpring", "# springs\nfrom,to,stiffness,GAy\na,b,1,2\n",
                  {"links.csv:2:1: error: the columns do not give a kind of link; in addition to from and "
                   "to there must be stiffness (for springs); EA and optionally mass_per_length (for "
                   "bars); EA, GJ, EIy, EIz and optionally GAy, GAz, mass_per_length (for beams); damping "
                   "(for dashpots); or third, E, nu, thickness and optionally density (for plates)"}),
        bad_links("BeamWithoutBending", "from,to,EA,GJ,EIy,GAy,GAz\na,b,1,1,1,2,2\n",
                  {"links.csv:1:1: error: the columns do not give a kind of link; in addition to from and "
                   "to there must be stiffness (for springs); EA and optionally mass_per_length (for "
                   "bars); EA, GJ, EIy, EIz and optionally GAy, GAz, mass_per_length (for beams); damping "
                   "(for dashpots); or third, E, nu, thickness and optionally density (for plates)"}),
        bad_links("SpringAndDashpot", "from,to,stiffness,damping\na,b,1,2\n",
                  {"links.csv:1:1: error: the columns do not give a kind of link; in addition to from and "
                   "to there must be stiffness (for springs); EA and optionally mass_per_length (for "
                   "bars); EA, GJ, EIy, EIz and optionally GAy, GAz, mass_per_length (for beams); damping "
                   "(for dashpots); or third, E, nu, thickness and optionally density (for plates)"}),
        bad_links("PlateOfTwoPoints", "from,to,E,nu,thickness\na,b,1,0.3,2\n",
                  {"links.csv:1:1: error: the columns do not give a kind of link; in addition to from and "
                   "to there must be stiffness (for springs); EA and optionally mass_per_length (for "
                   "bars); EA, GJ, EIy, EIz and optionally GAy, GAz, mass_per_length (for beams); damping "
                   "(for dashpots); or third, E, nu, thickness and optionally density (for plates)"}),
        bad_links("ViscousBeams", "from,to,EA,GJ,EIy,EIz,viscous\na,b,1,1,1,1,0.1\n",
                  {"links.csv:1:1: error: column 'viscous' is not for beams and plates, because rotations "
                   "carry no mass, and a moment that depends on their rate would make them states of their "
                   "own; use loss_factor, or damping: rayleigh"}),
        bad_links("ViscousPlates", "# skin\nfrom,to,third,E,nu,thickness,viscous\na,b,c,1,0.3,1,0.1\n",
                  {"links.csv:2:1: error: column 'viscous' is not for beams and plates, because rotations "
                   "carry no mass, and a moment that depends on their rate would make them states of their "
                   "own; use loss_factor, or damping: rayleigh"}),
        bad_links("LossesOfDashpots", "from,to,damping,viscous,loss_factor\na,b,1,1,1\n",
                  {"links.csv:1:1: error: column 'viscous' is not for dashpots, because they have no "
                   "stiffness; use damping, or add a spring",
                   "links.csv:1:1: error: column 'loss_factor' is not for dashpots, because they have no "
                   "stiffness; use damping, or add a spring"}),
        bad_links("Values", "from,to,third,E,nu,thickness,loss_factor\na,b,c,70 GPa,0.6,0,-1\n",
                  {"links.csv:2:7: error: link in row 1: E '70 GPa' has a unit, but must be a plain number "
                   "in SI units [Pa]; write 70000000000",
                   "links.csv:2:14: error: link in row 1: nu is 0.6, but must be > -1 and < 0.5",
                   "links.csv:2:18: error: link in row 1: thickness is 0 m, but must be > 0",
                   "links.csv:2:20: error: link in row 1: loss_factor is -1, but must be >= 0"}),
        bad_links("BeamValues", "from,to,EA,GJ,EIy,EIz,GAy,GAz\na,b,1,1,1,1,0,\n",
                  {"links.csv:2:13: error: link in row 1: GAy is 0 N, but must be > 0",
                   "links.csv:2:15: error: link in row 1: GAz is empty, but must be a number > 0 [N]"}),
        bad_links("SpringValues", "from,to,stiffness,viscous,loss_factor\na,b,1,-1,2 %\na,c,1,,0\n",
                  {"links.csv:2:7: error: link in row 1: viscous is -1 s, but must be >= 0",
                   "links.csv:2:10: error: link in row 1: loss_factor '2 %' has a unit, but must be a plain "
                   "number in SI units; write 0.02",
                   "links.csv:3:7: error: link in row 2: viscous is empty, but must be a number >= 0 [s]"}),
        bad_links("RowsOfTwoNames", "name,from,to,stiffness\nl,a,b,-1\nm n,a,b,-1\n",
                  {"links.csv:2:7: error: link 'l': stiffness is -1 N/m, but must be > 0",
                   "links.csv:3:1: error: link in row 2: name 'm n' must be 1 to 63 of A-Z a-z 0-9 _ . -",
                   "links.csv:3:9: error: link in row 2: stiffness is -1 N/m, but must be > 0"}),
        bad_links("DashpotValues", "from,to,damping\na,b,-1\n",
                  {"links.csv:2:5: error: link in row 1: damping is -1 N s/m, but must be > 0"}),
        bad_links("PlatePoints", "from,to,third,E,nu,thickness\na,b,a,1,0,1\na,b,d,1,0,1\n",
                  {"links.csv:2:5: error: link in row 1 names the point 'a' twice, but a plate needs three "
                   "different points",
                   "links.csv:3:5: error: link in row 2: third names the point 'd', which the scene does not "
                   "have; it "
                   "has a, b, c"})),
    bad_scene_name);

class Resource : public ::testing::TestWithParam<BadScene> {};

TEST_P(Resource, EachFaultIsReportedInTheExpectedWords) { expect_refused(GetParam()); }

INSTANTIATE_TEST_SUITE_P(
    BadScene, Resource,
    ::testing::Values(
        BadScene{"MissingCsv",
                 {{"scene.yaml", "points: {csv: points.csv}\n"}},
                 {"scene.yaml:1:15: error: cannot read 'points.csv': No such file or directory"}},
        BadScene{"FolderForAFile",
                 {{"scene.yaml", "points: {csv: .}\n"}},
                 {"scene.yaml:1:15: error: cannot read '.': it is a directory"}},
        BadScene{
            "NestedTooDeep",
            {{"scene.yaml",
              "points: [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]\n"}},
            {"scene.yaml:1:40: error: the text is nested deeper than 32 levels, but a scene needs at most "
             "6"}},
        BadScene{"MissingMatrix",
                 {{"scene.yaml", kMatrixScene}},
                 {"scene.yaml:5:26: error: cannot read 'K.mtx': No such file or directory"}}),
    bad_scene_name);

}  // namespace
}  // namespace freeflex::testing
