# cmake -DSOURCE_DIR=... "-DTYPES=a_t;b_t" -DOUTPUT=... -P wire_layouts.cmake: writes the tables of wire_layout.hpp for the
# structs of SOURCE_DIR/TYPE.lcm. An unknown construct is an error that names the file and the statement: if
# the field were skipped, its bytes would be received unchecked.
cmake_minimum_required(VERSION 3.25)

set(kinds boolean kBoolean byte kByte int8_t kInt8 int16_t kInt16 int32_t kInt32 int64_t kInt64 float kFloat
  double kDouble string kString)
while(kinds)
  list(POP_FRONT kinds word kind)
  set(kind_of_${word} ${kind})
endwhile()
set(word "[A-Za-z_][A-Za-z_0-9]*")

# reports an error in the file of ${type}
function(refuse found)
  message(FATAL_ERROR "${SOURCE_DIR}/${type}.lcm: ${found}")
endfunction()

# reads the statements of the struct without comments; replaces [ ] by < >, because CMake's lists interpret
# brackets
function(read_statements type out)
  file(READ ${SOURCE_DIR}/${type}.lcm text)
  string(REGEX REPLACE "//[^\n]*|/\\*([^*]|\\*+[^*/])*\\*+/" "" text "${text}")
  if(text MATCHES "[<>|\\\\]")
    refuse("'${CMAKE_MATCH_0}' is not known")
  endif()
  string(REPLACE "[" "<" text "${text}")
  string(REPLACE "]" ">" text "${text}")
  string(REPLACE ";" "|" text "${text}")
  string(REGEX REPLACE "[ \t\r\n]+" " " text "${text}")
  if(NOT text MATCHES "^ ?package freeflex_msgs ?\\| ?struct (${word}) ?{(.*[|]) ?} ?$" OR NOT CMAKE_MATCH_1 STREQUAL type)
    refuse("is not 'package freeflex_msgs; struct ${type} { fields }' and nothing else")
  endif()
  string(REPLACE "|" ";" statements "${CMAKE_MATCH_2}")
  set(${out} "${statements}" PARENT_SCOPE)
endfunction()

# converts "<3><n>" to "constant(3), counted_by(@count:n@)" and lists the counts that it names; numbers: the
# int32_t fields declared before
function(read_dimensions field text numbers out_sizes out_counts)
  set(sizes)
  set(counts)
  string(REGEX MATCHALL "[A-Za-z_0-9]+" dimensions "${text}")
  foreach(dimension IN LISTS dimensions)
    if(dimension MATCHES "^[1-9][0-9]?[0-9]?$")
      list(APPEND sizes "constant(${dimension})")
    elseif(dimension IN_LIST numbers)
      list(APPEND sizes "counted_by(@count:${dimension}@)")
      list(APPEND counts ${dimension})
    else()
      refuse("'${field}': the dimension '${dimension}' is neither 1 to 999 nor an int32_t before it")
    endif()
  endforeach()
  list(LENGTH sizes num_sizes)
  list(LENGTH counts num_counts)
  if(num_sizes GREATER 2 OR num_counts GREATER 1)
    refuse("'${field}': more than two dimensions, or more than one that is not constant")
  endif()
  list(JOIN sizes ", " sizes)
  set(${out_sizes} "${num_sizes}, {{${sizes}}}" PARENT_SCOPE)
  set(${out_counts} "${counts}" PARENT_SCOPE)
endfunction()

# makes the table of one struct and lists the structs that must be defined before it
function(make_table type out out_needs)
  read_statements(${type} statements)
  set(table "")
  set(needs)
  set(names)    # fields so far
  set(numbers)  # fields that may be counts
  set(counts)   # fields that are counts, one entry for each use
  foreach(statement IN LISTS statements)
    string(STRIP "${statement}" statement)
    if(statement STREQUAL "" OR statement MATCHES "^const (int(8|16|32|64)_t|float|double) [A-Za-z0-9_=,.+ -]+$")
      continue()
    endif()
    if(NOT statement MATCHES "^(${word}) (${word}) ?((< ?[A-Za-z_0-9]+ ?> ?)*)$")
      string(REPLACE "<" "[" statement "${statement}")
      string(REPLACE ">" "]" statement "${statement}")
      refuse("'${statement}' is neither TYPE NAME, TYPE NAME[SIZE] nor a constant")
    endif()
    set(field_type ${CMAKE_MATCH_1})
    set(field ${CMAKE_MATCH_2})
    set(dimensions "${CMAKE_MATCH_3}")
    set(nested nullptr)
    if(DEFINED kind_of_${field_type})
      set(kind ${kind_of_${field_type}})
    elseif(field_type IN_LIST TYPES)
      set(kind kStruct)
      set(nested "&${field_type}")
      list(APPEND needs ${field_type})
    else()
      refuse("'${statement}': the type is neither one of LCM's nor one of the project's")
    endif()
    read_dimensions(${field} "${dimensions}" "${numbers}" sizes used)
    list(APPEND counts ${used})
    list(APPEND names ${field})
    if(kind STREQUAL kInt32 AND dimensions STREQUAL "")
      list(APPEND numbers ${field})
    endif()
    string(APPEND table "    {\"${field}\", Kind::${kind}, ${nested}, @is:${field}@, ${sizes}},\n")
  endforeach()
  if(NOT names)
    refuse("has no field")
  endif()
  # only after the last field is it known which fields are counts
  set(next 0)
  foreach(name IN LISTS names)
    set(is_count false)
    if(name IN_LIST counts)
      set(is_count true)
      string(REPLACE "@count:${name}@" ${next} table "${table}")
      math(EXPR next "${next} + 1")
    endif()
    string(REPLACE "@is:${name}@" ${is_count} table "${table}")
  endforeach()
  set(${out} "inline constexpr Field ${type}_fields[] = {\n${table}};
inline constexpr Layout ${type} = make_layout(\"${type}\", ${type}_fields);\n" PARENT_SCOPE)
  set(${out_needs} "${needs}" PARENT_SCOPE)
endfunction()

set(includes "")
set(layouts "")
set(classes)
foreach(type IN LISTS TYPES)
  make_table(${type} table_${type} needs_${type})
  string(APPEND includes "#include \"freeflex_msgs/${type}.hpp\"\n")
  string(APPEND layouts "template <>
inline constexpr const Layout* layout_of<freeflex_msgs::${type}> = &layouts::${type};\n")
  list(APPEND classes "freeflex_msgs::${type}")
endforeach()

# each struct comes after the structs that it contains, so that a walk through the tables terminates
set(tables "")
set(waiting ${TYPES})
while(waiting)
  set(still)
  foreach(type IN LISTS waiting)
    set(missing ${needs_${type}})
    list(REMOVE_ITEM missing ${written})
    if(missing)
      list(APPEND still ${type})
    else()
      string(APPEND tables "${table_${type}}")
      list(APPEND written ${type})
    endif()
  endforeach()
  if(still STREQUAL waiting)
    list(JOIN still ", " still)
    message(FATAL_ERROR "${SOURCE_DIR}: structs that contain themselves or each other: ${still}")
  endif()
  set(waiting ${still})
endwhile()

list(JOIN classes ", " classes)
file(WRITE ${OUTPUT} "// Made from the .lcm files by messages/wire_layouts.cmake.
#pragma once

${includes}#include \"messages/wire_layout.hpp\"

namespace freeflex::wire {
namespace layouts {
${tables}}  // namespace layouts

${layouts}
/// List<every message and struct>
template <template <class...> class List>
using EachType = List<${classes}>;

}  // namespace freeflex::wire
")
