# GNU make; needs Python 3.11 or newer with venv, and pip's package index for the first run.
# Everything is installed into .venv; nothing else on the machine is touched.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Two files of tests at a time: most tests keep one core busy, kernels all of them. Threads of their matrix products would wait.
TWICE = OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n 2 --dist loadfile
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help demo gallery docs notebooks book test test-all test-clients converters bench bench-full bench-compare benchmark stress lint format clean

help: ## print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-13s %s\n", $$1, $$2 }' Makefile
	@echo "PYTHON=python3.12 picks another Python (after make clean)."

demo: $(VENV)/demo.stamp ## take the demonstration pictures
	@$(BIN)/python examples/demo.py

gallery: $(VENV)/demo.stamp ## take the pictures of docs/gallery.md and write gallery/index.html; TOPIC=flash takes one
	@$(BIN)/python docs/make_gallery.py $(TOPIC)

docs: $(VENV)/demo.stamp ## write docs/cameras.md, the figures of other pages and the tables of docs/raw_files.md
	@$(BIN)/python docs/make_cameras.py
	@$(BIN)/python docs/make_lens.py
	@$(BIN)/python docs/make_time.py
	@$(BIN)/python docs/make_gallery.py --no-index --out docs/images/gallery
	@$(BIN)/python docs/make_drawings.py
	@$(BIN)/python docs/make_effects.py
	@$(BIN)/python docs/make_charts.py
	@$(BIN)/python docs/make_color_tables.py
	@$(BIN)/photosite compare sony_a7s2 nikon_d850 --only snr --only dynamic_range --iso 100 --iso 1600 --out docs/images/compare_cameras.png

notebooks: $(VENV)/notebooks.stamp ## execute the notebooks of docs/notebooks and write what they print and draw
	@$(BIN)/python docs/make_notebooks.py

book: $(VENV)/book.stamp ## build these pages and the API as a book with search, into book/index.html
	@$(BIN)/python -m sphinx -q -W --keep-going -d build/book docs book && echo book/index.html

# Each process would rewrite the asserts of all tests, a tenth of a minute; those that fail are run again with rewritten ones.
test: $(VENV)/test.stamp ## run the tests that take seconds
	@$(TWICE) -m "not slow" --assert=plain || { $(BIN)/python -m pytest -m "not slow" --last-failed --last-failed-no-failures none; exit 1; }

test-all: $(VENV)/test.stamp $(VENV)/peers.stamp ## run every test, the minutes-long ones too
	@$(TWICE) -m "slow or not slow"

test-clients: $(VENV)/test.stamp $(VENV)/clients.stamp converters ## open the raw files with other converters; installs those that are missing
	@$(BIN)/python -m pytest -m clients

# ONLY=defocus,motion measures these sections alone; RESUME=1 leaves those that were measured at this commit.
BENCH = $(BIN)/python benchmarks/bench.py $(if $(ONLY),--only $(ONLY)) $(if $(RESUME),--resume)

bench: $(VENV)/demo.stamp $(VENV)/report.stamp ## measure run time against error beside packages that are installed (10 minutes)
	@$(BENCH)

bench-full: $(VENV)/demo.stamp $(VENV)/bench.stamp ## the same with larger frames, more turns, and all peers, which it installs
	@$(BENCH) --size full

benchmark: bench-full

bench-compare: $(VENV)/demo.stamp $(VENV)/report.stamp ## compare times and errors with another commit: make bench-compare BASE=main
	@test -n "$(BASE)" || { echo "error: name a commit, e.g. make bench-compare BASE=main"; exit 2; } >&2
	@$(BIN)/python benchmarks/checkouts/compare_results.py $(BASE) $(if $(ONLY),--only $(ONLY))

stress: $(VENV)/test.stamp ## search each kernel for the inputs at which it is farthest from float64; ten minutes
	@PYTHONPATH=tests:benchmarks $(BIN)/python -m stress && $(BIN)/python docs/make_stress.py

lint: $(VENV)/test.stamp $(VENV)/lint.stamp ## check the code with ruff, its types with mypy and pyright
	@$(BIN)/ruff check . && $(BIN)/ruff format --check .
	@$(BIN)/mypy && $(BIN)/pyright --pythonpath $(BIN)/python

format: $(VENV)/test.stamp ## format the code with ruff
	@$(BIN)/ruff check --fix . && $(BIN)/ruff format .

clean: ## remove .venv and everything built
	rm -rf $(VENV) build dist book photosite.egg-info .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# A stamp is touched last, so an interrupted installation is begun again.
$(VENV)/made.stamp:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "error: $(PYTHON) is missing or older than Python 3.11; choose another, e.g. make PYTHON=python3.12"; exit 1; } >&2
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "error: $(PYTHON) has no venv module; Debian and Ubuntu: apt install python3-venv"; exit 1; } >&2
	@echo "Making $(VENV) with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv --clear $(VENV)
	@touch $@

# A device that is there already is kept: pip's PoCL is older than Debian's and slower than a GPU.
$(VENV)/photosite.stamp: $(VENV)/made.stamp setup.cfg pyproject.toml
	@echo "Installing photosite into $(VENV) (once; a minute or two)"
	@$(INSTALL) --editable .
	@$(BIN)/photosite devices >/dev/null 2>&1 || { echo "No OpenCL device that builds kernels: adding PoCL from pip"; \
	  $(INSTALL) --editable '.[pocl]' && $(BIN)/photosite devices >/dev/null; } || { \
	  echo "error: no OpenCL device that builds kernels; Debian and Ubuntu: apt install pocl-opencl-icd"; exit 1; } >&2
	@touch $@

# The converters that test-clients runs, as program:package of Debian and Ubuntu. Tests of those still missing are skipped.
CONVERTERS := dcraw:dcraw exiftool:libimage-exiftool-perl exiv2:exiv2 darktable-cli:darktable rawtherapee-cli:rawtherapee

converters:
	@packages=; for pair in $(CONVERTERS); do command -v $${pair%%:*} >/dev/null || packages="$$packages $${pair##*:}"; done; \
	if [ -z "$$packages" ]; then exit 0; fi; \
	if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then echo "Installing$$packages"; \
	  { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends $$packages >/dev/null; } \
	  || echo "Not installed:$$packages; their tests are skipped"; \
	else echo "Missing, their tests are skipped; Debian and Ubuntu: sudo apt install$$packages"; fi

$(VENV)/clients.stamp: $(VENV)/photosite.stamp
	@echo "Installing Adobe's DNG SDK"
	@$(INSTALL) --editable '.[clients]' || echo "It cannot be installed here; its test is skipped"
	@touch $@

# A peer that does not install here is named by the benchmark and left out.
$(VENV)/bench.stamp: $(VENV)/photosite.stamp
	@echo "Installing the packages that the benchmarks compare with"
	@$(INSTALL) --editable '.[bench]' || { echo "Some of them cannot be installed here; going on without"; \
	  $(INSTALL) --editable '.[report]'; }
	@touch $@

$(VENV)/%.stamp: $(VENV)/photosite.stamp
	@echo "Installing what 'make $*' needs"
	@$(INSTALL) --editable '.[$*]'
	@touch $@
