# Each target works first on a fresh machine that has only Python 3.11, and reuses .venv after that.
#   make demo    set up, then one scene from the camera's image to the lifted object
#   make test    set up, then lint and every test
#   make lab     JupyterLab
#   make release generate labs/ from solutions/
#   make train   make the data again and train the shipped weights again (over an hour on two cores)
#   make stacks  build the same in C++, Java and Octave where they are installed, and compare
#   make bench   add the peers, measure against them, write BENCHMARKS.md
#   make clean   remove what can be made again in seconds; .venv and data/ stay
# make PYTHON=/path/to/python3.11 chooses an interpreter, make TORCH_INDEX=URL one of PyTorch's builds (README.md).

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := demo
.PHONY: demo test lab release train stacks bench clean

EXTRAS := instructor,stacks,test
BIN := .venv/bin
ARGS ?=

# Training: what the shipped weights were made with. EPOCHS is each model's own number if it is not given.
TRAIN_SCENES ?= 3000
VAL_SCENES ?= 120
SIZE ?= 320x240
WORKERS ?= 2
EPOCHS ?=
DEVICE ?= auto

demo: .venv/installed
	$(BIN)/labkit demo $(ARGS)

# Two processes with one thread each: with two each, they only wait for one another. ARGS="-n 8" takes more cores.
# Notebooks: outputs of lessons and solutions are compared with the committed ones, labs run as students get them.
NBVAL := -q --nbval-current-env --nbval-cell-timeout 240 -n 2 --dist loadfile
test: export OMP_NUM_THREADS := 1
test: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m pytest -n 2 --dist loadfile $(ARGS)
	$(BIN)/python -m pytest $(NBVAL) --nbval lessons solutions
	$(BIN)/python -m pytest $(NBVAL) --nbval-lax labs

lab: .venv/installed
	$(BIN)/jupyter lab $(ARGS)

release: .venv/installed
	$(BIN)/labkit release $(ARGS)

# Each step goes on where it was stopped, and does nothing if it was finished; the last one replaces the shipped weights.
train: .venv/installed
	$(BIN)/python -m data_gen data/train --scenes $(TRAIN_SCENES) --first-seed 0 --config train --size $(SIZE) --workers $(WORKERS)
	$(BIN)/python -m data_gen data/val --scenes $(VAL_SCENES) --first-seed 800000 --config test --size $(SIZE) --workers $(WORKERS)
	$(BIN)/labkit train data/train --val data/val --model smallsegnet $(if $(EPOCHS),--epochs $(EPOCHS)) --device $(DEVICE)
	$(BIN)/labkit train data/train --val data/val --model unet $(if $(EPOCHS),--epochs $(EPOCHS)) --device $(DEVICE)
	mkdir -p labkit/weights
	cp data/runs/smallsegnet.pt data/runs/unet.pt labkit/weights/

stacks: .venv/installed
	$(BIN)/python -m tests.stacks.run $(ARGS)

bench: .venv/installed-bench
	$(BIN)/python -m tests.bench.run $(ARGS)

clean:
	rm -rf out build *.egg-info .pytest_cache .ruff_cache .hypothesis .coverage
	find . -path ./.venv -prune -o -name __pycache__ -type d -exec rm -rf {} +

# .venv/installing is there while an installation runs and becomes .venv/installed when it ends. One that was killed
# leaves `installing` behind, and so does a failed one: nobody knows what is missing then, so the next make starts over.
# A changed pyproject.toml or constraints.txt only installs the difference.
.venv/installed: pyproject.toml constraints.txt
	@python=""; \
	for candidate in $(or $(PYTHON),python3.11 python3 python); do \
	    if "$$candidate" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; then \
	        python="$$candidate"; break; \
	    fi; \
	done; \
	if [ -z "$$python" ]; then \
	    echo "labkit needs Python 3.11 with its venv module (Debian, Ubuntu: python3.11-venv); $(if $(PYTHON),PYTHON=$(PYTHON) is not one,make PYTHON=/path/to/python3.11 names one)." >&2; \
	    exit 1; \
	fi; \
	if [ -e .venv/installing ] || ! $(BIN)/python -c 'import sys, pip; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; then \
	    rm -rf .venv; \
	fi; \
	mkdir -p .venv; \
	touch .venv/installing; \
	if [ ! -e $(BIN)/python ]; then \
	    echo "Setting up .venv: once, a minute or two where packages come quickly."; \
	    "$$python" -m venv .venv; \
	fi
	@if [ -n "$(TORCH_INDEX)" ]; then \
	    $(BIN)/python -m pip install --no-deps --index-url "$(TORCH_INDEX)" "$$(grep '^torch==' constraints.txt)"; \
	fi
	@$(BIN)/python -m pip install --disable-pip-version-check -c constraints.txt setuptools
	@$(BIN)/python -m pip install --disable-pip-version-check -c constraints.txt --no-build-isolation -e '.[$(EXTRAS)]'
	@mv .venv/installing $@

.venv/installed-bench: .venv/installed
	$(BIN)/python -m pip install --disable-pip-version-check -c constraints.txt --no-build-isolation -e '.[$(EXTRAS),bench]'
	touch $@
