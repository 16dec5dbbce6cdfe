# Every target works from a fresh clone: it makes the virtual environment first.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PYTEST := $(BIN)/pytest --numprocesses auto --dist loadgroup --durations 10
SCENES ?= ../shared/scenes
BOARD  ?= ulx3s_85f
SEEDS  ?= 1

.PHONY: help setup render test test-chips proofs lint first-light fpu-report arithmetic fpu-pairs mutants damage pipeline \
	chart bench stability cracks sdram bitstream board clean

help:
	@echo "make render       draw the built-in room on the simulated chip: build/render/room.png"
	@echo "make test         every test of a unit, a model or a tool"
	@echo "make test-chips   whole chips and boards, simulated, against their models"
	@echo "make proofs       what a solver shows of queues, caches and units"
	@echo "make lint         ruff"
	@echo "make first-light  the figures of docs/first-light.md, from the scenes in SCENES=$(SCENES)"
	@echo "make fpu-report   the figures of docs/fpu.md: every operator placed and routed; PEER=FILE puts others' beside ours"
	@echo "make arithmetic   what fused sums, tables and truncation do to pictures and datapaths, for docs/fpu.md"
	@echo "make fpu-pairs    ten million pairs through every operator, against exact integers: docs/results/fpu_pairs.json"
	@echo "make pipeline     the figures of docs/pipeline.md: full shading on the simulated chip"
	@echo "make chart        accuracy over formats and arithmetics, for docs/accuracy.md"
	@echo "make bench        the paper's Tables 3 and 4 beside it and beside Embree: docs/benchmarks.md and .html"
	@echo "make stability    where ray/triangle tests fail, the chip's and others': the figures of docs/accuracy.md"
	@echo "make cracks       a hundred million rays at the edges of real meshes, for docs/accuracy.md"
	@echo "make bitstream    build/BOARD/BOARD.bit, BOARD=$(BOARD): ulx3s_85f, ulx3s_45f, ulx3s_25f or icepi_zero; SEEDS=$(SEEDS)"
	@echo "make board        the room over the cable of a board simulated at its pins: build/board/screen.png"
	@echo "make sdram        the figures of docs/memory.md: a hundred million random accesses to an SDRAM, and its speed"
	@echo "make damage       ten thousand damaged scene files of each kind, read or refused: docs/results/damage.json"
	@echo "make mutants      faults planted in the operators, each found by a test: docs/results/mutants.json"

setup: $(VENV)/.ready

# Where there is no C++ compiler, a wheel brings one.
$(VENV)/.ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --editable ".[test$(shell command -v g++ clang++ >/dev/null || echo ,zig)]"
	@touch $@

render: setup
	@mkdir -p build/render
	$(BIN)/dynrt render room --output build/render/room.png --report build/render/room.json

test: setup
	$(PYTEST) -m "not chip and not proof"

test-chips: setup
	$(PYTEST) -m chip

proofs: setup
	$(PYTEST) -m "proof and not slow"

lint: setup
	$(BIN)/ruff check

first-light: setup
	$(BIN)/dynrt first-light --scenes $(SCENES)

fpu-report: setup
	$(BIN)/dynrt fpu-report $(if $(PEER),--peer $(PEER))

arithmetic: setup
	$(BIN)/dynrt arithmetic --scenes $(SCENES)

fpu-pairs: setup
	$(BIN)/python -m tests.fpu.pairs --output docs/results/fpu_pairs.json

mutants: setup
	$(BIN)/python -m tests.mutation --output docs/results/mutants.json

damage: setup
	$(BIN)/python -m tests.sim.scene.damage --output docs/results/damage.json

pipeline: setup
	$(BIN)/dynrt pipeline

chart: setup
	$(BIN)/dynrt chart --scenes $(SCENES)

# Without the folder of scenes, built-in ones stand for them.
bench: setup
	$(BIN)/dynrt bench $(if $(wildcard $(SCENES)),--scenes $(SCENES))

stability: setup
	$(BIN)/dynrt stability

cracks: setup
	$(BIN)/dynrt cracks --scenes $(SCENES)

sdram: setup
	$(BIN)/python -m tests.rtl.sdram.soak --output docs/results/sdram.json
	$(BIN)/python -m tests.rtl.sdram.place --output docs/results/sdram.json
	@mkdir -p build
	$(BIN)/dynrt render room --memory sdram --output build/sdram-room.png --report docs/results/sdram-room.json
	$(BIN)/python -m tests.rtl.sdram.page

bitstream: setup
	$(BIN)/dynrt build $(BOARD) --seeds $(SEEDS)

board: setup
	@mkdir -p build/board
	$(BIN)/python -m tests.sim.machine.board --board $(BOARD) --output build/board

clean:
	rm -rf build .pytest_cache .ruff_cache
