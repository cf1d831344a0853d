# host_tests: the tests of the host code alone, with no more sources than they need; what scripts/sanitize builds.
set(HOST_TESTS main body_silhouette_test body_test camera_path_test camera_test capture_test checkpoint_test config_test
    graph_test image_test inside_mesh_test memory_plan_test motion_test npz_test philox_test ply_test rasterise_test
    run_folder_test safetensors_test synth_test video_test walk_test)
list(TRANSFORM HOST_TESTS PREPEND tests/)
list(TRANSFORM HOST_TESTS APPEND .cpp)
set(HOST_OPS elementwise linear pack_weights reduction registry)
list(TRANSFORM HOST_OPS PREPEND src/ops/)
list(TRANSFORM HOST_OPS APPEND .cpp)
file(GLOB HOST_SOURCES CONFIGURE_DEPENDS src/io/*.cpp src/data/*.cpp src/graph/*.cpp src/runtime/*.cpp
     src/jobs/config*.cpp src/jobs/run_folder.cpp src/jobs/silhouette_scores.cpp src/jobs/spelling.cpp src/jobs/synth*.cpp src/jobs/toml_text.cpp)
add_executable(host_tests EXCLUDE_FROM_ALL ${HOST_TESTS} ${HOST_OPS} ${HOST_SOURCES} ${VIVANT_EMBEDDED_KERNELS})
target_include_directories(host_tests PRIVATE include src tests)
target_link_libraries(host_tests PRIVATE vivant_libraries doctest::doctest)
target_compile_definitions(host_tests PRIVATE VIVANT_SHARED_DATA="${CMAKE_SOURCE_DIR}/../shared/data"
  VIVANT_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
