# Kernels ahead of time: one C file for each unit (kernels/unit.py) and one shared object for each of
# SUPPLE_KERNEL_TARGETS in a folder of the target's name, in parallel and incrementally: a law's units
# depend on its energy file and on the generator, a load's on the latter. Which units, flags and files
# these are says kernels/ahead.py; nothing is listed here.
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
  foreach(processor ${SUPPLE_KERNEL_TARGETS})
    if(NOT processor IN_LIST known_targets)
      message(FATAL_ERROR "SUPPLE_KERNEL_TARGETS: expected some of ${known_targets}, got ${processor}")
    endif()
    string(MAKE_C_IDENTIFIER kernel_${unit}_${processor} target)
    add_library(${target} MODULE ${folder}/${unit}.c)
    set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME ${unit} SUFFIX ".so"
      LIBRARY_OUTPUT_DIRECTORY ${folder}/${processor} C_VISIBILITY_PRESET hidden C_STANDARD 17)
    target_compile_options(${target} PRIVATE -march=${processor} ${flags}
      $<$<C_COMPILER_ID:GNU>:${gcc_flags}> -Wall -Werror)
    target_link_libraries(${target} PRIVATE m)
    install(TARGETS ${target} LIBRARY DESTINATION supple/_kernels/${processor})
  endforeach()
endfunction()

execute_process(COMMAND ${kernels} --list ${SUPPLE_AOT} OUTPUT_VARIABLE list COMMAND_ERROR_IS_FATAL ANY)
cmake_language(EVAL CODE "${list}") # sets known_targets, flags, gcc_flags, generator; calls add_units

install(FILES ${contract} DESTINATION supple/_kernels)
