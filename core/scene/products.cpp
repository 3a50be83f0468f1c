#include "core/scene/products.hpp"

namespace Eigen::internal {

template struct gebp_kernel<double, double, Index, blas_data_mapper<double, Index, ColMajor>, 4, 4>;
template struct gemm_pack_rhs<double, Index, ReadsColumns, 4, ColMajor>;
template struct gemm_pack_rhs<double, Index, ReadsRows, 4, RowMajor>;
template struct general_matrix_vector_product<Index, double, ReadsColumns, ColMajor, false, double,
                                              ReadsColumns, false>;
template struct general_matrix_vector_product<Index, double, ReadsColumns, ColMajor, false, double, ReadsRows,
                                              false>;
template struct general_matrix_vector_product<Index, double, ReadsRows, RowMajor, false, double, ReadsColumns,
                                              false>;
template struct general_matrix_vector_product<Index, double, ReadsRows, RowMajor, false, double, ReadsRows,
                                              false, BuiltIn>;
template void evaluateProductBlockingSizesHeuristic<double, double, 1, Index>(Index&, Index&, Index&, Index);
template void evaluateProductBlockingSizesHeuristic<double, double, 4, Index>(Index&, Index&, Index&, Index);
template void assign_sparse_to_sparse(SparseMatrix<double>&, const SparseMatrix<double>&);

}  // namespace Eigen::internal
