# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Completion of slsd, slsctl, slsd-web, slsd-tcp, slsd-dds and slsd-model for bash. Commands, options and values are those of the programs' own --help.

_slsd() {
  local program=$1 current=$2 previous=$3 command='' word help values=''
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case $word in -* | */* | *.*) ;; *) if [[ $program == *slsctl && -z $command ]]; then command=$word; fi ;; esac
  done
  help=$("$program" ${command:+"$command"} --help 2>/dev/null) || return 0
  if [[ $previous == --* ]]; then
    values=$(sed -nE "s/^  (-.,)?$previous \{([^}]*)\}.*/\2/p" <<<"$help" | tr ',' ' ')
    if [[ -z $values ]] && grep -qE -- "^  (-.,)?$previous [A-Za-z0-9]" <<<"$help"; then return 0; fi
  fi
  if [[ -n $values ]]; then
    :
  elif [[ $current == -* ]]; then
    values=$(grep -oE -- '(^| |,)--?[a-z][a-z-]*' <<<"$help" | tr -d ' ,' | sort -u)
  elif [[ $program == *slsctl && -z $command ]]; then
    values=$(sed -n 's/^  \([a-z][a-z-]*\)  .*/\1/p' <<<"$help")
  else
    values=$(sed -nE 's/^  [A-Z]+ \{([^}]*)\}.*/\1/p' <<<"$help" | tr ',' ' ')
  fi
  mapfile -t COMPREPLY < <(compgen -W "$values" -- "$current")
}
complete -o default -F _slsd slsd slsctl slsd-web slsd-tcp slsd-dds slsd-model
