# Kernels ahead of time: one C file and one shared object for each unit (kernels/unit.py), in parallel
# and incrementally: a law's units depend on its energy file and on the generator, a load's on the
# latter. Which units, flags and files these are says kernels/ahead.py; nothing is listed here.
set(materials ${CMAKE_SOURCE_DIR}/materials)
set(folder ${CMAKE_BINARY_DIR}/kernels)
set(contract ${CMAKE_SOURCE_DIR}/cpp/include/supple/kernel.h)
set(kernels ${CMAKE_COMMAND} -E env PYTHONDONTWRITEBYTECODE=1 PYTHONHASHSEED=0
  PYTHONPATH=${CMAKE_SOURCE_DIR} ${Python_EXECUTABLE} -m kernels --materials ${materials})

file(GLOB energy_files CONFIGURE_DEPENDS ${materials}/*.py)
file(GLOB_RECURSE kernel_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/kernels/*.py)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${kernel_files})
if(SUPPLE_AOT STREQUAL all) # what a law can take stands in its file
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${energy_files})
endif()

# The C of some units by one process; their law "" where they are loads.
function(add_units law)
  set(energy_file "")
  if(law)
    set(energy_file ${materials}/${law}.py)
  endif()
  list(TRANSFORM ARGN REPLACE "(.+)" "${folder}/\\1.c" OUTPUT_VARIABLE sources)
  list(GET ARGN 0 first)
  add_custom_command(
    OUTPUT ${sources}
    COMMAND ${kernels} ${ARGN} --contract ${contract} --out ${folder}
    DEPENDS ${generator} ${contract} ${energy_file}
    COMMENT "Kernels of ${first} and its like"
    VERBATIM)
  foreach(unit ${ARGN})
    add_unit(${unit})
  endforeach()
endfunction()

function(add_unit unit)
  string(REPLACE "." "_" target kernel_${unit})
  add_library(${target} MODULE ${folder}/${unit}.c)
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME ${unit} SUFFIX ".so"
    LIBRARY_OUTPUT_DIRECTORY ${folder} C_VISIBILITY_PRESET hidden C_STANDARD 17)
  target_compile_options(${target} PRIVATE ${flags} $<$<C_COMPILER_ID:GNU>:${gcc_flags}> -Wall -Werror)
  if(SUPPLE_NATIVE)
    target_compile_options(${target} PRIVATE -march=native)
  endif()
  target_link_libraries(${target} PRIVATE m)
  install(TARGETS ${target} LIBRARY DESTINATION supple/_kernels)
endfunction()

execute_process(COMMAND ${kernels} --list ${SUPPLE_AOT} OUTPUT_VARIABLE list COMMAND_ERROR_IS_FATAL ANY)
cmake_language(EVAL CODE "${list}") # sets flags, gcc_flags and generator, and calls add_units

install(FILES ${contract} DESTINATION supple/_kernels)
