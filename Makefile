# make demo   install what is missing, calibrate a sand on real YADE runs, write the report   (FRESH=1: no shipped runs)
# make paper  the reference paper's case: calibrate on the shipped runs, fill docs/paper_case.md   (AFRESH=1: verify on YADE anew)
# make test   install what is missing, run all checks and tests
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CASE ?= cases/coarse_sand.toml
export OMP_NUM_THREADS ?= 1

.PHONY: demo paper test test-cluster lint lab yade clean
demo: yade $(VENV)/.done
	$(BIN)/calibrator all $(CASE) $(if $(FRESH),--fresh)

paper: yade $(VENV)/.done
	$(BIN)/calibrator all cases/quartz_sand_reduced.toml $(if $(AFRESH),--verify-afresh)
	$(BIN)/python -m benchmarks.paper_case

test: yade $(VENV)/.done-test lint
	$(BIN)/python -m pytest -q

# The tests of --engine slurm, on a SLURM of their own.
test-cluster: yade $(VENV)/.done-test
	bash tests/slurm_local.sh install
	$(BIN)/python -m pytest -q -m cluster tests/test_cluster.py

lint: $(VENV)/.done-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The synthetic measurement behind the demo, made anew (see cases/coarse_sand_lab.csv for what it is).
lab: yade $(VENV)/.done
	$(BIN)/python cases/make_lab.py

# YADE and the tools around it, from Debian; nothing happens where they are installed.
yade:
	@for p in yade yade-batch setpriv unshare flock timeout; do command -v $$p >/dev/null || missing=1; done; \
	$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || missing=1; \
	if [ -n "$$missing" ]; then \
	  sudo=$$([ $$(id -u) = 0 ] || echo sudo); \
	  $$sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -y -qq --no-install-recommends \
	    yade util-linux coreutils python3-venv >/dev/null || { echo "could not install YADE: it needs Debian 12 and root or sudo" >&2; exit 1; }; \
	fi

$(VENV)/.done: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install -q --disable-pip-version-check -e .
	touch $@

$(VENV)/.done-test: $(VENV)/.done
	$(BIN)/pip install -q --disable-pip-version-check -e '.[test]'
	touch $@

clean:
	rm -rf $(VENV) results
