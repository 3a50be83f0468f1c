#include "tools/control/matrix_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include "core/index.hpp"
#include "service/io/scene/text.hpp"
#include "service/io/wire/log.hpp"

namespace freeflex::control {
namespace {

using Names = std::vector<std::string>;

std::string ending_of(const std::string& path) {
  return io::reader::lower(std::filesystem::path(path).extension().string());
}

template <class Value>
void put(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value),
               sizeof value);  // little-endian, as all machines it runs on
}

std::string csv_of(const StateSpace& model) {
  std::string text = "row";
  for (const Names* names : {&model.states, &model.inputs})
    for (const std::string& name : *names) text += "," + name;
  text += "\n";
  const auto add = [&](const std::string& name, const Eigen::MatrixXd& by_state,
                       const Eigen::MatrixXd& by_input, Eigen::Index row) {
    text += name;
    for (const Eigen::MatrixXd* matrix : {&by_state, &by_input})
      for (Eigen::Index k = 0; k < matrix->cols(); ++k)
        text += "," + io::reader::format_number((*matrix)(row, k));
    text += "\n";
  };
  for (Eigen::Index k = 0; k < model.A.rows(); ++k)
    add("d/dt " + model.states[index(k)], model.A, model.B, k);
  for (Eigen::Index k = 0; k < model.C.rows(); ++k) add(model.outputs[index(k)], model.C, model.D, k);
  return text;
}

/// Appends a matrix of a MAT-file of level 4: type, rows, columns, imaginary part, length of the name, the
/// name, and the numbers by columns. Type 0 is a matrix of doubles, type 51 text in bytes; both are
/// little-endian.
void put_mat(std::string& bytes, const std::string& name, std::int32_t type, Eigen::Index rows,
             Eigen::Index columns, const std::function<void()>& put_values) {
  for (const std::int32_t value : {type, static_cast<std::int32_t>(rows), static_cast<std::int32_t>(columns),
                                   0, static_cast<std::int32_t>(name.size() + 1)})
    put(bytes, value);
  bytes.append(name.c_str(), name.size() + 1);
  put_values();
}

std::string mat_of(const StateSpace& model) {
  std::string bytes;
  for (const auto& [name, matrix] : {std::pair("A", &model.A), std::pair("B", &model.B),
                                     std::pair("C", &model.C), std::pair("D", &model.D)})
    put_mat(bytes, name, 0, matrix->rows(), matrix->cols(), [&bytes, matrix = matrix] {
      for (Eigen::Index k = 0; k < matrix->size(); ++k) put(bytes, matrix->data()[k]);
    });
  for (const auto& [name, names] : {std::pair("states", &model.states), std::pair("inputs", &model.inputs),
                                    std::pair("outputs", &model.outputs)}) {
    std::size_t longest = 0;
    for (const std::string& each : *names) longest = std::max(longest, each.size());
    put_mat(bytes, name, 51, static_cast<Eigen::Index>(names->size()), static_cast<Eigen::Index>(longest),
            [&bytes, names = names, longest] {
              for (std::size_t column = 0; column < longest; ++column)
                for (const std::string& each : *names) bytes += column < each.size() ? each[column] : ' ';
            });
  }
  return bytes;
}

/// Returns an array of NumPy's format 1.0: the mark, a header of a multiple of 64 bytes, and the values.
std::string npy_of(const std::string& kind, bool is_by_columns, const std::string& shape,
                   const std::string& values) {
  std::string header = "{'descr': '" + kind + "', 'fortran_order': " + (is_by_columns ? "True" : "False") +
                       ", 'shape': (" + shape + "), }";
  constexpr std::size_t kFront = 10;
  header.resize((kFront + header.size() + 1 + 63) / 64 * 64 - kFront - 1, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  put(bytes, static_cast<std::uint16_t>(header.size()));
  return bytes + header + values;
}

std::string npy_of(const Eigen::MatrixXd& matrix) {
  const std::string values(reinterpret_cast<const char*>(matrix.data()),
                           static_cast<std::size_t>(matrix.size()) * sizeof(double));
  return npy_of("<f8", true, std::to_string(matrix.rows()) + ", " + std::to_string(matrix.cols()), values);
}

std::string npy_of(const Names& names) {
  std::size_t longest = 1;
  for (const std::string& each : names) longest = std::max(longest, each.size());
  std::string values;
  for (const std::string& each : names)
    for (std::size_t k = 0; k < longest; ++k)
      put(values, static_cast<std::uint32_t>(k < each.size() ? static_cast<unsigned char>(each[k]) : 0));
  return npy_of("<U" + std::to_string(longest), false, std::to_string(names.size()) + ",", values);
}

std::uint32_t crc32(const std::string& bytes) {
  std::uint32_t crc = ~std::uint32_t{0};
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

/// Returns a ZIP archive whose files are not compressed (APPNOTE.TXT of PKWARE, sections 4.3.7, 4.3.12
/// and 4.3.16).
std::string zip_of(const std::vector<std::pair<std::string, std::string>>& files) {
  std::string bytes, directory;
  for (const auto& [name, content] : files) {
    const auto offset = static_cast<std::uint32_t>(bytes.size());
    std::string common;
    for (const int value : {20, 0, 0, 0, 33})  // version, flags, method, time, 1980-01-01
      put(common, static_cast<std::uint16_t>(value));
    put(common, crc32(content));
    for (int size = 0; size < 2; ++size) put(common, static_cast<std::uint32_t>(content.size()));
    put(common, static_cast<std::uint16_t>(name.size()));
    put(common, std::uint16_t{0});
    put(bytes, std::uint32_t{0x04034b50});
    bytes += common;
    bytes += name;
    bytes += content;
    put(directory, std::uint32_t{0x02014b50});
    put(directory, std::uint16_t{20});
    directory += common;
    for (int k = 0; k < 3; ++k) put(directory, std::uint16_t{0});
    put(directory, std::uint32_t{0});
    put(directory, offset);
    directory += name;
  }
  const auto start = static_cast<std::uint32_t>(bytes.size());
  bytes += directory;
  put(bytes, std::uint32_t{0x06054b50});
  for (int k = 0; k < 2; ++k) put(bytes, std::uint16_t{0});
  for (int k = 0; k < 2; ++k) put(bytes, static_cast<std::uint16_t>(files.size()));
  put(bytes, static_cast<std::uint32_t>(directory.size()));
  put(bytes, start);
  put(bytes, std::uint16_t{0});
  return bytes;
}

std::string npz_of(const StateSpace& model) {
  return zip_of({{"A.npy", npy_of(model.A)},
                 {"B.npy", npy_of(model.B)},
                 {"C.npy", npy_of(model.C)},
                 {"D.npy", npy_of(model.D)},
                 {"states.npy", npy_of(model.states)},
                 {"inputs.npy", npy_of(model.inputs)},
                 {"outputs.npy", npy_of(model.outputs)}});
}

}  // namespace

bool is_model_file(const std::string& path) {
  const std::string ending = ending_of(path);
  return ending == ".csv" || ending == ".mat" || ending == ".npz";
}

std::string write_model(const StateSpace& model, const std::string& path) {
  const std::string ending = ending_of(path);
  io::PartialFile file(path);
  std::ofstream stream(file.working_path(), std::ios::binary);
  stream << (ending == ".csv" ? csv_of(model) : ending == ".mat" ? mat_of(model) : npz_of(model));
  stream.close();
  if (!stream) return "cannot write '" + path + "': " + std::strerror(errno);
  return file.commit();
}

}  // namespace freeflex::control
