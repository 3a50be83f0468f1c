#include "tools/campaign/hdf5_table.hpp"

#include <hdf5.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <vector>

#include "service/campaign/case.hpp"
#include "service/io/wire/log.hpp"
#include "tools/campaign/columns.hpp"
#include "tools/campaign/summary.hpp"

namespace freeflex::campaign {
namespace {

/// An object of the HDF5 library, which closes with its scope.
class Hdf5Object {
 public:
  Hdf5Object(hid_t id, herr_t (*closer)(hid_t)) : id_(id), close_(closer) {}
  ~Hdf5Object() { close(); }
  Hdf5Object(const Hdf5Object&) = delete;
  Hdf5Object& operator=(const Hdf5Object&) = delete;

  hid_t id() const { return id_; }
  bool is_open() const { return id_ >= 0; }
  /// Returns false if the object was not open, or its last data could not be written.
  bool close() {
    const hid_t id = id_;
    id_ = -1;
    return id >= 0 && close_(id) >= 0;
  }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Writes one dataset. Returns false if that failed.
bool write_dataset(hid_t file, const std::string& name, hid_t type, std::size_t count, const void* data) {
  const auto size = static_cast<hsize_t>(count);
  Hdf5Object space(H5Screate_simple(1, &size, nullptr), H5Sclose);
  Hdf5Object properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_obj_track_times(properties.id(), false);  // the bytes depend on the rows alone
  Hdf5Object dataset(
      H5Dcreate2(file, name.c_str(), type, space.id(), H5P_DEFAULT, properties.id(), H5P_DEFAULT), H5Dclose);
  if (!dataset.is_open()) return false;
  const bool is_written =
      count == 0 || H5Dwrite(dataset.id(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0;
  return dataset.close() && is_written;
}

bool write_numbers(hid_t file, const std::string& name, const std::vector<double>& values) {
  return write_dataset(file, name, H5T_NATIVE_DOUBLE, values.size(), values.data());
}

// strings of one length, because every reader of HDF5 knows them
bool write_texts(hid_t file, const std::string& name, const std::vector<std::string>& texts) {
  std::size_t length = 1;
  for (const std::string& text : texts) length = std::max(length, text.size());
  std::string bytes(length * texts.size(), '\0');
  for (std::size_t k = 0; k < texts.size(); ++k) texts[k].copy(&bytes[k * length], length);
  Hdf5Object type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.id(), length);
  H5Tset_strpad(type.id(), H5T_STR_NULLPAD);
  H5Tset_cset(type.id(), H5T_CSET_UTF8);
  return write_dataset(file, name, type.id(), texts.size(), bytes.data());
}

bool write_columns(hid_t file, const Campaign& campaign, const Results& results) {
  const Columns columns = columns_of(campaign, results);
  bool is_ok = write_dataset(file, "case", H5T_NATIVE_INT64, columns.cases.size(), columns.cases.data()) &&
               write_texts(file, "outcome", columns.outcomes) &&
               write_texts(file, "message", columns.messages);
  for (std::size_t k = 0; k < columns.variables.size() && is_ok; ++k) {
    const std::string& name = campaign.variables[k].name;
    const auto* const choice = std::get_if<Choice>(&campaign.sampling.variables[k]);
    if (choice == nullptr || is_numeric(*choice)) {
      is_ok = write_numbers(file, name, columns.variables[k].values);
      continue;
    }
    std::vector<std::string> texts;
    for (const auto& [number, stored] : results.rows) texts.push_back(fields_of(stored.row)[2 + k]);
    is_ok = write_texts(file, name, texts);
  }
  for (std::size_t k = 0; k < columns.measures.size() && is_ok; ++k)
    is_ok = write_numbers(file, columns.measures[k].name, columns.measures[k].values);
  return is_ok;
}

}  // namespace

std::string write_hdf5(const Opened& opened, const Results& results, const std::string& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // the library prints nothing itself
  // The file is made in memory, because after a failed write (a full disk) the library crashes when the
  // program ends.
  Hdf5Object properties(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  constexpr std::size_t kBytesAtATime = std::size_t{1} << 20;
  H5Pset_fapl_core(properties.id(), kBytesAtATime, false);
  Hdf5Object file(H5Fcreate("cases.h5", H5F_ACC_TRUNC, H5P_DEFAULT, properties.id()), H5Fclose);
  if (!file.is_open() || !write_columns(file.id(), opened.campaign, results) ||
      H5Fflush(file.id(), H5F_SCOPE_GLOBAL) < 0)
    return "cannot write '" + path + "': HDF5 refused, perhaps because memory ran out";
  const ssize_t size = H5Fget_file_image(file.id(), nullptr, 0);
  std::vector<char> bytes(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  if (size <= 0 || H5Fget_file_image(file.id(), bytes.data(), bytes.size()) != size)
    return "cannot write '" + path + "': HDF5 refused";
  io::PartialFile partial(path);
  errno = 0;
  std::ofstream stream(partial.working_path(), std::ios::binary);
  stream.write(bytes.data(), size);
  stream.close();
  if (!stream) return "cannot write '" + path + "': " + std::strerror(errno);
  return partial.commit();
}

}  // namespace freeflex::campaign
