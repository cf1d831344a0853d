# Embeds kernels/*.cl and *.clh in the binary, and lints each kernel file with clang.
file(GLOB KERNEL_FILES CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/kernels/*.cl ${CMAKE_SOURCE_DIR}/kernels/*.clh)
set(VIVANT_EMBEDDED_KERNELS ${CMAKE_BINARY_DIR}/embedded_kernels.cpp)
add_custom_command(
  OUTPUT ${VIVANT_EMBEDDED_KERNELS}
  COMMAND ${CMAKE_COMMAND} -DOUTPUT=${VIVANT_EMBEDDED_KERNELS} "-DFILES=${KERNEL_FILES}"
          -P ${CMAKE_SOURCE_DIR}/cmake/embed_files.cmake
  DEPENDS ${KERNEL_FILES} ${CMAKE_SOURCE_DIR}/cmake/embed_files.cmake
  VERBATIM)

set(LINT_STAMPS)
if(VIVANT_LINT_KERNELS)
  find_program(CLANG NAMES clang-14 clang REQUIRED)
  foreach(file ${KERNEL_FILES})
    if(file MATCHES "\\.cl$")
      get_filename_component(stem ${file} NAME_WE)
      set(stamp ${CMAKE_BINARY_DIR}/lint/${stem}.stamp)
      add_custom_command(
        OUTPUT ${stamp}
        COMMAND ${CLANG} -x cl -cl-std=CL1.2 -Xclang -finclude-default-header -target spir64 -fsyntax-only
                -Wall -Wextra -Wno-unused-parameter -Werror -I${CMAKE_SOURCE_DIR}/kernels ${file}
        # Once more with the forms for matrix units.
        COMMAND ${CLANG} -x cl -cl-std=CL1.2 -Xclang -finclude-default-header -target spir64 -fsyntax-only
                -Wall -Wextra -Wno-unused-parameter -Werror -DMATRIX_UNITS=3 -I${CMAKE_SOURCE_DIR}/kernels ${file}
        COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/lint
        COMMAND ${CMAKE_COMMAND} -E touch ${stamp}
        DEPENDS ${KERNEL_FILES}
        COMMENT "Linting ${stem}.cl"
        VERBATIM)
      list(APPEND LINT_STAMPS ${stamp})
    endif()
  endforeach()
endif()
add_custom_target(vivant_kernel_lint DEPENDS ${LINT_STAMPS})
