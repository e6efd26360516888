# Installs the build, moves the installation, builds somebody else's project against it and runs that.

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " line)
    message(FATAL_ERROR "${line}\nfailed (${result}):\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

function(expect text)
  string(FIND "${output}" "${text}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "\"${text}\" is not in:\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/first)
file(RENAME ${WORK}/first ${WORK}/moved)

file(GLOB_RECURSE files ${WORK}/moved/*.cmake ${WORK}/moved/*.json)
foreach(file IN LISTS files)
  file(READ ${file} text)
  foreach(path ${BUILD} ${WORK}/first)
    string(FIND "${text}" ${path} at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${file} names ${path}: the package can't be moved")
    endif()
  endforeach()
endforeach()

run(${CMAKE_COMMAND} -S ${OUTSIDE} -B ${WORK}/outside -DCMAKE_PREFIX_PATH=${WORK}/moved -DCMAKE_CXX_COMPILER=${CXX}
    -DCMAKE_BUILD_TYPE=Release)
run(${CMAKE_COMMAND} --build ${WORK}/outside)
run(${CMAKE_COMMAND} -E env --unset=TRILUME_HOME ${WORK}/outside/host ${WORK}/outside/plugins/toy)
expect("home ${WORK}/moved\n")
expect("bytes 400\n")
expect("pathtrace")
expect("composite made")

run(${CMAKE_COMMAND} -E env --unset=TRILUME_HOME ${WORK}/moved/bin/trilume info)
expect("visibility")
