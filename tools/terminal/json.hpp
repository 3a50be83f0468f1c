// JSON as the tools write it, in the order it was put together. Compiled once: its templates cost the
// compiler seconds in every file that builds a value.
#pragma once

#include <nlohmann/json.hpp>

extern template class nlohmann::basic_json<nlohmann::ordered_map>;
