# Two commands do everything on a fresh machine:
#   make study   set up, run the main job (the aluminium spring of the thesis), print the report's path
#   make test    set up, check style, run the tests
# While working: make check runs the style checks and the fast tests.
PYTHON ?= python3
VENV ?= .venv
DESIGN ?= al1
OUT ?= out
JOBS ?= 2
BIN := $(VENV)/bin

.PHONY: study test long check lint benchmark parts docs wheels clean

# the smallest runs of all engines: tests in two processes would compile each twice
GIVEN := import numpy as np; from rsea_core import ActuatorModel, Inputs, Load, Replay, Rig, simulate; \
	t = np.arange(9) * 1e-3; given = Inputs(time_s=t, duty=0 * t, load=Load(kind='locked')); \
	model = ActuatorModel(Rig.preset('rsea-bench'))

# tests that compile what the others need beside the engines: two lists, side by side
COMPILE := PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -q -n 0
IDENTIFY := tests/rsea_core/identify
WINDOWS := $(IDENTIFY)/multistep/test_diagnosis.py::test_one_recording_of_a_bare_pendulum_shows_its_dry_friction \
	$(IDENTIFY)/multistep/test_error_filter.py $(IDENTIFY)/locate/test_unknown_input.py::test_the_likelihood_of_readings_is_that_of_the_dense_gaussian \
	tests/dftfs/proof/wide/truth/test_kernel.py tests/dftfs/cli/test_prove.py::test_cases_follow_the_contract \
	tests/rsea_core/effects/test_sensor_table.py $(IDENTIFY)/result/test_report_data.py
FREE_RUNS := tests/rsea_core/effects/test_planted_effects.py::test_a_diagnosis_names_fits_and_writes_it_and_its_file_predicts \
	tests/dftfs/fem/test_friction.py::test_sliding_block_needs_mu_times_its_weight_and_turns_the_work_into_heat tests/dftfs/fem/test_plasticity.py \
	tests/dftfs/analysis/strength/test_friction_loop.py::test_no_friction_no_loop

# what the system lacks: installed by root where there is apt-get (make NO_APT=1 refuses), else named
INSTALL := install() { \
	if [ -z "$(NO_APT)" ] && [ "$$(id -u)" = 0 ] && command -v apt-get > /dev/null; then \
		echo "[setup] apt-get install $$* (make NO_APT=1 refuses)"; \
		{ apt-get -qq update && DEBIAN_FRONTEND=noninteractive \
		apt-get -qq install --no-install-recommends "$$@" < /dev/null; } > /dev/null || exit 2; \
	else echo "[setup] missing on this system; on Debian or Ubuntu, as root: apt-get install $$*"; exit 2; fi; }; install

$(VENV)/.study: pyproject.toml constraints.txt
	@echo "[setup] checking $(PYTHON) and the system libraries"
	@command -v $(PYTHON) > /dev/null || { $(INSTALL) python3-venv; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "[setup] $(PYTHON) is older than 3.11: install python3.11 or newer, or say make PYTHON=..."; exit 2; }
	@missing=$$($(PYTHON) -m dftfs.cad.system_libraries) || exit 2; [ -z "$$missing" ] || { $(INSTALL) $$missing; }
	@echo "[setup] making the environment $(VENV) (a few minutes the first time)"
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check -c constraints.txt -e '.[all]'
	@echo "[setup] compiling the kernels (once; numba keeps them)"
	@$(BIN)/dftfs verify ref --states 1 --no-mesh-error --json > /dev/null 2>&1 & others=$$!; \
		$(BIN)/dftfs simulate dftfs/examples/torque-1hz.toml --json > /dev/null 2>&1; engine=$$?; \
		wait $$others && exit $$engine
	@touch $@

$(VENV)/.test: $(VENV)/.study
	@echo "[setup] adding the test tools"
	@$(BIN)/python -m pip install -qq --disable-pip-version-check -c constraints.txt -e '.[test,interop,logs,peers,cluster]'
	@$(BIN)/python -c "$(GIVEN); Replay.of(given).run(model)" & others=$$!; \
		$(BIN)/python -c "$(GIVEN); simulate(model, given); simulate(model, given, engine='event-driven')"; engine=$$?; \
		wait $$others && exit $$engine
	@$(COMPILE) $(WINDOWS) > /dev/null 2>&1 & others=$$!; $(COMPILE) $(FREE_RUNS) > /dev/null 2>&1; wait $$others; true
	@touch $@

study: $(VENV)/.study
	@echo "[study] parameters -> CAD -> mesh -> finite elements -> actuator -> report"
	@$(BIN)/dftfs study $(DESIGN) --out $(OUT)/study-$(DESIGN) --force || [ $$? -eq 1 ]

lint: $(VENV)/.test
	@$(BIN)/ruff check . && $(BIN)/ruff format --check .

# a worker that crashes ends the run; one that is lost without a word is tests/worker_watch.py's
# (one thread of BLAS each: two processes with two threads each wait for one another;
# modules are kept compiled, for the second process, for commands in tests and the next run)
TESTS := PYTHONDONTWRITEBYTECODE= OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder --max-worker-restart=0

test: lint
	@echo "[test] running the tests on $(JOBS) processes"
	@$(TESTS)

# what takes longer: whole diagnoses, fine meshes (tests/long_tests.txt)
long: lint
	@echo "[long] running the long tests on $(JOBS) processes"
	@$(TESTS) --long

check: lint
	@echo "[check] running the fast tests on $(JOBS) processes"
	@$(TESTS) -m fast

# the reference parts of Table 2.6 with drawings and manifest; tests compare their geometry
parts: $(VENV)/.study
	@$(BIN)/dftfs parts --out cad_out --force

# the manual, for a browser without a network: out/docs/index.html
docs: $(VENV)/.study
	@$(BIN)/python -m pip install -qq --disable-pip-version-check -c constraints.txt -e '.[docs]'
	@$(BIN)/python docs/commands.py && $(BIN)/python docs/api.py
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet && echo "$(CURDIR)/out/docs/index.html"

# rsea-core alone and dftfs on top of it, each tried in an environment of its own
wheels: $(VENV)/.study
	@$(BIN)/python -m benchmarks.wheels --out $(OUT)/wheels

benchmark: $(VENV)/.test
	@for script in rod_against_3d root_compliance calculix simulation_peers; do \
		echo "[benchmark] $$script"; PYTHONPATH=. $(BIN)/python benchmarks/$$script.py || exit 1; done

clean:
	rm -rf $(VENV) $(OUT) build *.egg-info
