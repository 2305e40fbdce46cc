# Each target works first on a fresh machine that has only Python 3.11 to 3.13, and reuses its environment after that.
#   make demo    set up .venv, then one scene from the camera's image to the lifted object
#   make test    set up .venv, then lint, tests and notebooks; ARGS="labkit data_gen" the tests of these rooms alone
#   make nightly the tests that `make test` leaves out, because they only repeat others at length
#   make prose   what is written, not what it does: numbers of README, links, names, words and lint of the notebooks
#   make lab     JupyterLab; alone on a machine, it installs what students need and no more
#   make release generate labs/ from solutions/
#   make train   make the data again and train the shipped weights again (over three hours on two cores)
#   make stacks  build the same in C++, Java and Octave where they are installed, and compare
#   make ros2    set up .venv-ros2 with wheels of ROS 2, then the node beside a simulated camera, until Ctrl-C
#   make test-ros2  the tests of ROS 2, there
#   make site    set up .venv-site, then a static site of lessons, labs, guides and reference in out/site
#   make pictures  README's pictures of the demo, a lab and the site, made anew in Chromium; ARGS=lab one of them
#   make test-site  its links, its words for figures, and what axe-core says of it
#   make slides  set up .venv-site, then a deck of slides per topic in out/slides, with notes, for a room without a network
#   make hub     set up .venv-hub, then a JupyterHub for trying on this machine alone (docs/hub.md)
#   make test-hub  three users through lab 04 on it, in Chromium
#   make test-models  set up .venv-models with transformers and others, and tests of their networks as they come
#   make bench   set up .venv-bench with the peers, measure against them, write BENCHMARKS.md
#   make evidence write docs/evidence.md, README's promises and what shows them, from results that are there
#   make fresh   `make demo` and `make test` on a bare Debian, which has nothing but Python, make and git
#   make everywhere  the same on two Debians, with Python 3.11 and 3.13; what both make of fixed seeds is compared
#   make colab   lessons and labs with Google Colab's versions and the wheel alone; a mock, not Colab itself
#   make clean   remove what can be made again in seconds; environments and data/ stay
# make PYTHON=/path/to/python3.12 chooses an interpreter, make TORCH_INDEX=URL one of PyTorch's builds (docs/install.md).

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.ONESHELL:
.DEFAULT_GOAL := demo
.PHONY: colab demo test nightly prose lab release train stacks ros2 test-ros2 bench evidence fresh everywhere clean site slides pictures test-site hub test-hub test-models

BIN := .venv/bin
ARGS ?=

demo: .venv/installed
	$(BIN)/labkit demo $(ARGS)

test: .venv/installed
	tests/run $(ARGS)

nightly: .venv/installed
	tests/run --nightly $(ARGS)

# Cells: names that are undefined or unused, statements that do nothing, old NumPy, errors of syntax; a lab's answers are
# missing, which would have used what is unused there.
LINT := ruff check --isolated --no-cache --line-length 120 --target-version py311 --select E4,E7,E9,F,W,B,PLE,NPY,UP
prose: .venv/installed
	$(BIN)/$(LINT) lessons solutions
	$(BIN)/$(LINT) --ignore F401,F841 labs
	$(BIN)/python -m pytest -q tests/prose $(ARGS)

# JupyterLab with the course's settings and kernel. A .venv that has everything is used as it is. A new one gets all but
# PyTorch, which is a third of it or, with CUDA, most: that comes while the first lesson is read.
lab: export JUPYTER_CONFIG_PATH := $(CURDIR)/labcourse/jupyter
lab: export JUPYTER_PATH := $(JUPYTER_CONFIG_PATH)
lab: $(or $(wildcard .venv/installed),.venv/installed-lab)
	@if [ ! -e .venv/installed ] && [ ! -e .venv/torch ]; then
	    echo "PyTorch comes in the background, and this terminal says when it is there. Topics 01 and 04 do not need it."
	    (
	        pip="$(BIN)/python -m pip install --disable-pip-version-check --progress-bar off"
	        if { [ -z "$(TORCH_INDEX)" ] || $$pip $(TORCH_BUILD); } > .venv/torch.log 2>&1 &&
	            $$pip -c constraints.txt --no-compile torch >> .venv/torch.log 2>&1; then
	            touch .venv/torch
	            echo "PyTorch is there. Where a notebook missed it, run the cell again."
	        else
	            echo "pip could not install PyTorch: .venv/torch.log says why, and make lab tries again."
	        fi
	    ) &
	fi
	$(BIN)/jupyter lab $(ARGS)
	wait

release: .venv/installed
	$(BIN)/labkit release $(ARGS)

stacks: .venv/installed
	$(BIN)/python -m pytest -q tests/labcourse/stacks/test_programs.py $(ARGS)

ros2: .venv-ros2/installed
	.venv-ros2/bin/labkit node ros --sim $(ARGS)

test-ros2: export OMP_NUM_THREADS := 1
test-ros2: .venv-ros2/installed
	.venv-ros2/bin/python -m pytest tests/labros/test_ros2.py $(ARGS)

bench: .venv-bench/installed
	.venv-bench/bin/python -m bench.run $(ARGS)

evidence: .venv/installed
	$(BIN)/python tests/prose/evidence.py

fresh: .venv/installed
	$(BIN)/python tests/fresh/run $(ARGS)

# With Chromium each lesson is there as a PDF, too.
site: export LABKIT_PDF := $(wildcard /usr/bin/chromium)
site: .venv-site/installed
	.venv-site/bin/python -m sphinx -q -W --keep-going -b html -c docs/site . out/site
	@echo "wrote out/site/index.html"

pictures: .venv/installed
	$(BIN)/python docs/pictures.py $(ARGS)

slides: .venv-site/installed
	.venv-site/bin/python docs/slides/deck.py out/slides

test-site: .venv-site/installed
	.venv-site/bin/python -m pytest tests/test_site.py $(ARGS)

hub: .venv-hub/installed
	.venv-hub/bin/python -m jupyterhub -f deploy/try_hub.py $(ARGS)

test-hub: .venv-hub/installed
	.venv-hub/bin/python -m pytest tests/labcourse/test_hub.py $(ARGS)

test-models: .venv-models/installed
	.venv-models/bin/python -m pytest --nightly tests/labkit/learning/test_libraries.py $(ARGS)

everywhere: .venv/installed
	$(BIN)/python tests/fresh/run --suite bookworm trixie $(ARGS)

colab: .venv/installed
	$(BIN)/python tests/colab/run $(ARGS)

clean:
	rm -rf out build *.egg-info .pytest_cache .ruff_cache .hypothesis .coverage
	find . -path './.venv*' -prune -o -name __pycache__ -type d -exec rm -rf {} +

# Training: what the shipped weights were made with. EPOCHS is each model's own number if it is not given.
TRAIN_SCENES ?= 3000
WIDE_SCENES ?= 1500
ANY_SCENES ?= 1000
CLUTTER_SCENES ?= 700
BIN_SCENES ?= 300
MESSY_SCENES ?= 700
VAL_SCENES ?= 120
SIZE ?= 320x240
WORKERS ?= 2
EPOCHS ?=
DEVICE ?= auto

# Each step resumes where it was stopped, and does nothing if it was finished; the last ones replace the shipped weights.
train: .venv/installed
	$(BIN)/python -m data_gen data/train --scenes $(TRAIN_SCENES) --first-seed 0 --config train --size $(SIZE) --workers $(WORKERS)
	$(BIN)/python -m data_gen data/val --scenes $(VAL_SCENES) --first-seed 800000 --config test --size $(SIZE) --workers $(WORKERS)
	$(BIN)/python -m data_gen data/wide --scenes $(WIDE_SCENES) --first-seed 0 --config wide --size $(SIZE) --workers $(WORKERS)
	$(BIN)/python -m data_gen data/any --scenes $(ANY_SCENES) --first-seed 0 --config any --size $(SIZE) --workers $(WORKERS)
	$(BIN)/python -m data_gen data/clutter --scenes $(CLUTTER_SCENES) --first-seed 0 --config clutter --size $(SIZE) --workers $(WORKERS)
	$(BIN)/python -m data_gen data/bin --scenes $(BIN_SCENES) --first-seed 0 --config bin --size $(SIZE) --workers $(WORKERS)
	$(BIN)/python -m data_gen data/messy --scenes $(MESSY_SCENES) --first-seed 0 --config messy --size $(SIZE) --workers $(WORKERS)
	for model in smallsegnet unet; do
	    $(BIN)/labkit train data/train --val data/val --model $$model $(if $(EPOCHS),--epochs $(EPOCHS)) --device $(DEVICE)
	done
	rgbd="$(BIN)/labkit train --scenes $(WIDE_SCENES) --val data/val --device $(DEVICE) data/train"
	$$rgbd data/wide --model unet_rgbd --epochs $(or $(EPOCHS),24)
	$$rgbd data/wide --init data/runs/unet_rgbd.pt --epochs $(or $(EPOCHS),24) --lr 2e-3 --seed 1 --out data/runs/again
	$(BIN)/labkit train data/any data/train --scenes $(ANY_SCENES) --init data/runs/again/unet_rgbd.pt --epochs $(or $(EPOCHS),40) \
	    --lr 1.5e-3 --seed 2 --device $(DEVICE) --out data/runs/any
	$(BIN)/labkit train data/messy data/any data/clutter data/bin --scenes $(CLUTTER_SCENES) --things --batch 16 \
	    --init data/runs/any/unet_rgbd.pt --epochs $(or $(EPOCHS),55) --seed 3 --device $(DEVICE) \
	    --workers $(if $(filter cuda,$(DEVICE)),$(WORKERS),0) --out data/runs/things
	cp data/runs/{smallsegnet,unet}.pt data/runs/things/unet_rgbd.pt labkit/weights/
	for model in smallsegnet unet; do $(BIN)/labkit export --model $$model --onnx labkit/weights/$$model.onnx; done

# pip's arguments for the build of PyTorch that TORCH_INDEX asks for; what it requires comes from the usual index.
TORCHES := torch
TORCH_BUILD = --no-deps --index-url "$(TORCH_INDEX)" $$(grep -E '^($(TORCHES))==' constraints.txt)

# Environments, and the extras of pyproject.toml that each holds.
.venv/installed: EXTRAS := course,instructor,stacks,cluster,test
.venv/installed-lab: EXTRAS := course,stacks
# What a laptop does not import is not compiled: half a minute and 300 MB less. A shared installation needs it all.
.venv/installed-lab: MORE := --no-compile
.venv-bench/installed: EXTRAS := course,instructor,stacks,cluster,test,bench
.venv-site/installed: EXTRAS := course,instructor,stacks,cluster,test,site
.venv-hub/installed: EXTRAS := course,instructor,stacks,test,hub
.venv-models/installed: EXTRAS := stacks,test,models
.venv-models/installed: TORCHES := torch|torchvision
.venv-ros2/installed: EXTRAS := stacks,test
.venv-ros2/installed: MORE := -r constraints-ros2.txt
.venv-ros2/installed: constraints-ros2.txt

# What `make lab` installs first: a list from pyproject.toml, since PyTorch is a dependency of the kit.
export define ALL_BUT_TORCH
import sys, tomllib
project = tomllib.load(open("pyproject.toml", "rb"))["project"]
lists = [project["dependencies"], *map(project["optional-dependencies"].get, sys.argv[1:])]
print(*[name for names in lists for name in names if name.partition(">")[0] != "torch"], sep="\n")
endef
COMMA := ,

# A file `installing` is there while an installation runs and becomes `installed` when it ends. One that was killed leaves
# `installing` behind, and so does a failed one: nobody knows what is missing then, so the next make starts over.
# A changed pyproject.toml or constraints.txt only installs the difference.
.venv/installed .venv/installed-lab .venv-bench/installed .venv-site/installed .venv-ros2/installed .venv-hub/installed .venv-models/installed: pyproject.toml constraints.txt
	@is_right='import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))'
	for python in $(or $(PYTHON),python3.13 python3.12 python3.11 python3 python) ""; do
	    if "$$python" -c "$$is_right" 2>/dev/null; then break; fi
	done
	if [ -z "$$python" ]; then
	    echo "labkit needs Python 3.11, 3.12 or 3.13 with its venv module (Debian, Ubuntu: python3-venv); $(if $(PYTHON),PYTHON=$(PYTHON) is not one,make PYTHON=/path/to/python3.12 names one)." >&2
	    exit 1
	fi
	if [ -e $(@D)/installing ] || ! $(@D)/bin/python -c "import pip; $$is_right" 2>/dev/null; then rm -rf $(@D); fi
	mkdir -p $(@D)
	touch $(@D)/installing
	if [ ! -e $(@D)/bin/python ]; then
	    echo "Setting up $(@D) with $$("$$python" --version): once, a minute or two where packages come quickly."
	    "$$python" -m venv $(@D)
	fi
	# pip says two thousand lines: they go to a file, and a terminal shows how far it is.
	log=$(@D)/install.log
	echo "Installing packages; what pip says goes to $$log."
	how_far() {
	    if names=$$(grep '^Installing collected packages' $$log); then
	        echo "unpacking $$(tr , '\n' <<< "$$names" | wc -l) packages: $$(ls $(@D)/lib/python*/site-packages | grep -c dist-info) are there"
	    else
	        echo "finding and downloading packages: $$(grep -c '^Collecting' $$log)"
	    fi
	}
	if [ -t 1 ]; then
	    while sleep 1 && kill -0 $$$$ 2>/dev/null; do printf '\r\033[K  %s' "$$(how_far)"; done &
	    trap "kill $$! 2>/dev/null; printf '\r\033[K'" EXIT
	fi
	install() {
	    if ! $(@D)/bin/python -m pip install --disable-pip-version-check --progress-bar off "$$@" > $$log 2>&1; then
	        printf '\n%s\n' "pip failed. The end of $$log:" "$$(tail -n 15 $$log)" >&2
	        exit 1
	    fi
	}
	$(@D)/bin/python -m pip uninstall --quiet --yes labkit 2> /dev/null # the kit under its former name
	install -c constraints.txt setuptools
	if [ $@ = .venv/installed-lab ]; then
	    $(@D)/bin/python -c "$$ALL_BUT_TORCH" $(subst $(COMMA), ,$(EXTRAS)) > $(@D)/first.txt
	    install -c constraints.txt -r $(@D)/first.txt $(MORE)
	    install --no-deps --no-build-isolation -e .
	else
	    if [ -n "$(TORCH_INDEX)" ]; then install $(TORCH_BUILD); fi
	    install -c constraints.txt --no-build-isolation -e '.[$(EXTRAS)]' $(MORE)
	fi
	mv $(@D)/installing $@
