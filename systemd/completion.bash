# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
# Completion of slsd, slsctl, slsd-web and slsd-dds for bash. Commands and options are those that the programs' own --help lists.

_slsd() {
  local program=$1 current=$2 previous=$3 command='' word help
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    case $word in -* | */* | *.*) ;; *) if [[ $program == *slsctl && -z $command ]]; then command=$word; fi ;; esac
  done
  case $previous in
    --log-level) mapfile -t COMPREPLY < <(compgen -W 'trace debug info warning error critical' -- "$current"); return ;;
    --density) mapfile -t COMPREPLY < <(compgen -W 'symbols pixels' -- "$current"); return ;;
    --code) mapfile -t COMPREPLY < <(compgen -W 'pattern gray' -- "$current"); return ;;
    calibrate) if [[ $current != -* ]]; then mapfile -t COMPREPLY < <(compgen -W 'begin look end cancel' -- "$current"); return; fi ;;
    project) mapfile -t COMPREPLY < <(compgen -W 'pattern idle black white focus grid' -- "$current"); return ;;
    --paper) mapfile -t COMPREPLY < <(compgen -W 'A0 A1 A2 A3 A4 letter' -- "$current"); return ;;
  esac
  help=$("$program" ${command:+"$command"} --help 2>/dev/null) || return 0
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(grep -oE -- '(^| |,)--?[a-z][a-z-]*' <<<"$help" | tr -d ' ,' | sort -u)" -- "$current")
  elif [[ $program == *slsctl && -z $command ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(sed -n '/^Subcommands:/,$ s/^  \([a-z][a-z-]*\).*/\1/p' <<<"$help")" -- "$current")
  fi
}
complete -o default -F _slsd slsd slsctl slsd-web slsd-dds
