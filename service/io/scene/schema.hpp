// What editors complete and check scenes by.
#pragma once

#include <string>

namespace freeflex::io {

/// JSON Schema (draft 07) of scenes, made of the table of keys. It refuses nothing that read_scene takes;
/// files, references and physics are beyond it.
std::string scene_schema();

}  // namespace freeflex::io
