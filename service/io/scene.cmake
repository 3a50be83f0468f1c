target_sources(freeflex_io PRIVATE scene_report.cpp scene_text.cpp scene_yaml.cpp scene_fields.cpp scene_csv.cpp
  scene_matrix.cpp scene_points.cpp scene_links.cpp scene_link_tables.cpp scene_loads.cpp scene_feedback.cpp scene_fidelity.cpp scene_leave_out.cpp
  scene_physics.cpp scene_reader.cpp scene_faults.cpp plan_file.cpp)
