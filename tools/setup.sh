#!/bin/sh
# Set up a virtual environment from the locked versions: sh tools/setup.sh run|dev|learn VENV [PYTHON]
#
# run: what phasmid runs with; dev: the developer's packages, too; learn: PyTorch on top of these.
# uv is used when it is there, pip when not. VENV/.ready stamps an environment in which phasmid
# runs, VENV/.develop one with the developer's packages. A stamp is removed first and written last:
# a set-up that was cut short is repeated.
set -e
kind=$1 venv=$2 python=$3
cd -P "$(dirname "$0")/.."
if [ -d "$venv/Scripts" ]; then bin=$venv/Scripts; else bin=$venv/bin; fi
if command -v uv >/dev/null 2>&1; then with=uv; else with=pip; fi

pip() {
	"$bin/python" -m pip --disable-pip-version-check --no-input install "$@"
}

# Shows in a terminal, on one line, what pip does; its errors where it fails.
follow_pip() {
	count=0 failed=1
	while IFS= read -r line; do
		case $line in
			"Collecting "*) count=$((count + 1)) line="$count ${line#Collecting }" ;;
			"Installing "*) line=installing ;;
			done.) failed=0 line= ;;
			*) continue ;;
		esac
		if [ -t 1 ]; then printf '\r\033[K%.70s' "${line:+   }${line%% (*}"; fi
	done
	if [ $failed = 1 ]; then cat "$venv/pip.log" >&2; fi
	return $failed
}

# Installs files of locked packages, and phasmid from here. Bytecode is compiled at the first import.
install() {
	if [ $with = uv ]; then
		quiet=--quiet
		if [ -t 1 ]; then quiet=; fi
		uv pip sync $quiet --python "$bin/python" --require-hashes --only-binary :all: "$@"
		uv pip install --quiet --python "$bin/python" --no-deps --no-build-isolation --editable .
		return
	fi
	for file in "$@"; do
		set -- "$@" --requirement "$file"
		shift
	done
	{
		PYTHONUNBUFFERED=1 pip --progress-bar off --no-compile --require-hashes \
			--only-binary :all: "$@" 2>"$venv/pip.log" && echo "done."
	} | follow_pip
	pip --quiet --quiet --no-deps --no-build-isolation --editable .
}

find_python() {
	if [ -n "$python" ]; then
		set -- "$python"
	else
		set -- python3 python3.14 python3.13 python3.12 python3.11 python
	fi
	for candidate in "$@"; do
		if "$candidate" -c "import sys; sys.exit(sys.version_info < (3, 11))" >/dev/null 2>&1; then
			python=$candidate
			return
		fi
	done
	echo "phasmid needs Python 3.11 or newer and found none${python:+ at $python}; name one:" \
		"make PYTHON=/path/to/python3." >&2
	exit 1
}

make_environment() {
	find_python
	if [ -e "$venv" ] && [ ! -f "$venv/pyvenv.cfg" ] && [ -n "$(ls -A "$venv")" ]; then
		echo "$venv holds something other than a virtual environment; name another folder:" \
			"make VENV=..." >&2
		exit 1
	fi
	rm -rf "$venv"
	echo "== setting up $venv with $with: some 40 packages, 0.6 GB"
	if [ $with = uv ]; then
		uv venv --quiet --python "$("$python" -c "import sys; print(sys.executable)")" "$venv"
	else
		"$python" -m venv "$venv" || {
			echo "$python cannot make a virtual environment; on Debian and Ubuntu, install" \
				"python3-venv." >&2
			rm -rf "$venv"
			exit 1
		}
	fi
	if [ -d "$venv/Scripts" ]; then bin=$venv/Scripts; fi
}

case $kind in
	run)
		# The stamp names the folder it was made for: a copied or moved folder, or a Python that has
		# gone, asks for a new set-up.
		stands=$(cat "$venv/.ready" 2>/dev/null || true)
		rm -f "$venv/.ready"
		if [ "$stands" = "$PWD" ] && "$bin/python" -c "" 2>/dev/null; then
			echo "== bringing $venv up to date with $with"
		else
			make_environment
		fi
		if [ -e "$venv/.develop" ]; then packages=dev; else packages=run; fi
		install requirements/$packages.txt requirements/build.txt
		echo "$PWD" >"$venv/.ready"
		;;
	dev)
		rm -f "$venv/.develop"
		echo "== adding the developer's packages to $venv: some 120, 1.6 GB"
		install requirements/dev.txt requirements/build.txt
		touch "$venv/.develop"
		;;
	learn)
		# Not among the locked packages: PyTorch's builds differ by machine, and most take gigabytes.
		trainers="torch==2.13.0 stable-baselines3==2.9.2"
		echo "== adding PyTorch and Stable-Baselines3 to $venv"
		if [ $with = uv ]; then
			uv pip install --quiet --python "$bin/python" $trainers
		else
			pip --quiet $trainers
		fi
		;;
esac
