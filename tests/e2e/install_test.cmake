# Installs the build into a prefix of its own and builds and runs tests/e2e/consumer against it.
# cmake -Dbuild_dir=... -Dsource_dir=... -Dwork_dir=... -Dversion=... -Dcompiler=... -Dflags=... -P install_test.cmake
function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# An old prefix could hide what the install rules no longer provide.
file(REMOVE_RECURSE ${work_dir})
set(prefix ${work_dir}/prefix)
run(${CMAKE_COMMAND} --install ${build_dir} --prefix ${prefix})
foreach(program fanstream-server fanstream-client fanstream-load)
  run(${prefix}/bin/${program} --help)
endforeach()

run(${CMAKE_COMMAND} -G Ninja -S ${source_dir}/consumer -B ${work_dir}/consumer -DCMAKE_BUILD_TYPE=Debug
  -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${compiler} -DCMAKE_CXX_FLAGS=${flags} -Dwanted_version=${version})
run(${CMAKE_COMMAND} --build ${work_dir}/consumer)
run(${work_dir}/consumer/consumer)
