# Installs what a program prints about itself: completions for bash and zsh, and its manual page.

# groundray_install_texts(PROGRAM): the program runs at installation, so not where it was built for another machine.
function(groundray_install_texts program)
  if(CMAKE_CROSSCOMPILING)
    return()
  endif()
  set(texts ${PROJECT_BINARY_DIR}/texts/${program})
  install(CODE "
    file(MAKE_DIRECTORY \"${texts}\")
    function(print_text file)
      execute_process(COMMAND \"$<TARGET_FILE:${program}>\" \${ARGN}
        OUTPUT_FILE \"${texts}/\${file}\" COMMAND_ERROR_IS_FATAL ANY)
    endfunction()
    print_text(${program} --completion bash)
    print_text(_${program} --completion zsh)
    print_text(${program}.1 --man)")
  install(FILES ${texts}/${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  install(FILES ${texts}/_${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
  install(FILES ${texts}/${program}.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
endfunction()
