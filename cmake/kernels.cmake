# Kernels ahead of time: one C file and one shared object for each unit (kernels/unit.py), in parallel
# and incrementally: an energy file's units depend on that file alone, and on the generator.
set(demo_laws neo_hookean corotational_polar)
file(GLOB energy_files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/materials/*.py)
file(GLOB_RECURSE generator CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/kernels/*.py)
list(REMOVE_ITEM generator ${CMAKE_SOURCE_DIR}/kernels/build.py)
set(contract ${CMAKE_SOURCE_DIR}/cpp/include/supple/kernel.h)

function(add_unit unit)
  set(source ${CMAKE_BINARY_DIR}/kernels/${unit}.c)
  add_custom_command(
    OUTPUT ${source}
    COMMAND ${CMAKE_COMMAND} -E env PYTHONDONTWRITEBYTECODE=1 PYTHONHASHSEED=0 PYTHONPATH=${CMAKE_SOURCE_DIR}
            ${Python_EXECUTABLE} -m kernels ${unit} --materials ${CMAKE_SOURCE_DIR}/materials
            --contract ${contract} --out ${source}
    DEPENDS ${generator} ${contract} ${ARGN}
    COMMENT "Kernels of ${unit}"
    VERBATIM)
  string(REPLACE "." "_" target kernel_${unit})
  add_library(${target} MODULE ${source})
  set_target_properties(${target} PROPERTIES PREFIX "" OUTPUT_NAME ${unit} SUFFIX ".so"
    LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/kernels C_VISIBILITY_PRESET hidden C_STANDARD 17)
  target_compile_options(${target} PRIVATE -O3 -fno-math-errno -fno-trapping-math
    -fno-signed-zeros -ffp-contract=fast -Wall -Werror)
  if(SUPPLE_NATIVE)
    target_compile_options(${target} PRIVATE -march=native)
  endif()
  target_link_libraries(${target} PRIVATE m)
  install(TARGETS ${target} LIBRARY DESTINATION supple/_kernels)
endfunction()

foreach(element P1 P2 Q1 Q2)
  foreach(load body_force body_force_rest)
    add_unit(${load}.${element})
  endforeach()
endforeach()
foreach(facet T1 T2 S1 S2)
  foreach(load traction traction_moved pressure pressure_moved)
    add_unit(${load}.${facet})
  endforeach()
endforeach()

foreach(file ${energy_files})
  get_filename_component(law ${file} NAME_WE)
  if(SUPPLE_AOT STREQUAL all OR law IN_LIST demo_laws)
    foreach(element P1 P2 Q1 Q2)
      add_unit(${law}.${element}.direct ${file})
      add_unit(${law}.${element}.inverse ${file})
    endforeach()
  endif()
  if(law STREQUAL neo_hookean)
    foreach(facet T1 T2 S1 S2)
      add_unit(${law}.${facet}.skin_direct ${file})
      add_unit(${law}.${facet}.skin_inverse ${file})
    endforeach()
  endif()
endforeach()

# The synthetic patient's own law, so that the demo compiles nothing.
if(NOT SUPPLE_AOT STREQUAL all)
  add_unit(mooney_rivlin.Q1.direct ${CMAKE_SOURCE_DIR}/materials/mooney_rivlin.py)
endif()

install(FILES ${contract} DESTINATION supple/_kernels)
