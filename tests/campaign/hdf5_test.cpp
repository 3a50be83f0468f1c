// The table of a campaign in HDF5, read with that library.
#include <gtest/gtest.h>
#include <hdf5.h>

#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/scene/temporary_folder.hpp"
#include "tools/campaign/hdf5_table.hpp"

namespace freeflex::campaign {
namespace {

Opened three_columns() {
  Opened opened;
  opened.campaign.variables.resize(2);
  opened.campaign.variables[0].name = "points.tip.mass";
  opened.campaign.variables[1].name = "law";
  opened.campaign.sampling.variables = {Uniform{1.0, 2.0}, Choice{{"soft", "very hard"}}};
  opened.campaign.measures.push_back({.name = "error"});
  return opened;
}

Results two_rows() {
  Results results;
  results.rows[3] = {"3,passed,1.25,soft,1e-300,", 0.0, 0.0};
  results.rows[5] = {"5,refused,1.5,very hard,,\"mass, which \xC2\xB1\"", 0.0, 0.0};
  return results;
}

template <class T>
std::array<T, 2> read(hid_t file, const char* name, hid_t type) {
  std::array<T, 2> values{};
  const hid_t dataset = H5Dopen2(file, name, H5P_DEFAULT);
  EXPECT_GE(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << name;
  H5Dclose(dataset);
  return values;
}

std::vector<std::string> read_texts(hid_t file, const char* name) {
  const hid_t dataset = H5Dopen2(file, name, H5P_DEFAULT), type = H5Dget_type(dataset);
  const std::size_t length = H5Tget_size(type);
  std::string bytes(2 * length, '?');
  EXPECT_GE(H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()), 0) << name;
  H5Tclose(type);
  H5Dclose(dataset);
  return {bytes.substr(0, length).c_str(), bytes.substr(length).c_str()};
}

std::string bytes_of(const char* path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

TEST(Hdf5Table, HasTheNumbersAndTextsOfTheRows) {
  const testing::TemporaryFolder folder;
  ASSERT_EQ(write_hdf5(three_columns(), two_rows(), "cases.h5"), "");
  const hid_t file = H5Fopen("cases.h5", H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  EXPECT_EQ(read<std::int64_t>(file, "case", H5T_NATIVE_INT64), (std::array<std::int64_t, 2>{3, 5}));
  EXPECT_EQ(read<double>(file, "points.tip.mass", H5T_NATIVE_DOUBLE), (std::array<double, 2>{1.25, 1.5}));
  const auto errors = read<double>(file, "error", H5T_NATIVE_DOUBLE);
  EXPECT_EQ(errors[0], 1e-300);
  EXPECT_TRUE(std::isnan(errors[1]));
  using Texts = std::vector<std::string>;
  EXPECT_EQ(read_texts(file, "outcome"), (Texts{"passed", "refused"}));
  EXPECT_EQ(read_texts(file, "law"), (Texts{"soft", "very hard"}));
  EXPECT_EQ(read_texts(file, "message"), (Texts{"", "mass, which \xC2\xB1"}));
  H5Fclose(file);
}

TEST(Hdf5Table, HasTheSameBytesEachTime) {
  const testing::TemporaryFolder folder;
  ASSERT_EQ(write_hdf5(three_columns(), two_rows(), "a.h5"), "");
  ASSERT_EQ(write_hdf5(three_columns(), two_rows(), "b.h5"), "");
  EXPECT_EQ(bytes_of("a.h5"), bytes_of("b.h5"));
}

TEST(Hdf5Table, ThatCannotBeWrittenGivesTheReason) {
  const testing::TemporaryFolder folder;
  EXPECT_EQ(write_hdf5(three_columns(), two_rows(), "none/cases.h5"),
            "cannot write 'none/cases.h5': No such file or directory");
}

}  // namespace
}  // namespace freeflex::campaign
