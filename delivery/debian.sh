#!/bin/sh
# From a bare Debian to a calibrator that runs. The Containerfile and `make test-debian13` take the same steps:
#   debian.sh system         Debian's packages: YADE, Python, and what runs are wrapped into   (root)
#   debian.sh install        the wheel of this checkout in an environment of its own, and `calibrator` on the PATH   (root)
#   debian.sh root [SUITE]   a bare root of that Debian (trixie) with nothing but git, make and python3, and `inside` in it   (root)
#   debian.sh inside         make demo, the tests on the real YADE, and what a container does: system, install, calibrator demo
# PARTS="demo tests container" are those of `inside`; ROOT=folder keeps the root there, MIRROR=URL is where its packages come from.
set -eu
cd "$(dirname "$0")/.."
place=/opt/calibrator
get="env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends"

part() { # part NAME COMMAND...: say what it took
  name=$1 begin=$(date +%s); shift
  echo "== $name"
  "$@"
  echo "== $name: $(($(date +%s) - begin)) s"
}

container() {
  part system sh delivery/debian.sh system
  part install sh delivery/debian.sh install
  cd "$(mktemp -d)" # a folder that is not a checkout, as a user's
  calibrator doctor
  part "calibrator demo" calibrator demo
}

tests() {
  make -s yade .venv/.done-test
  .venv/bin/python -m pytest -q -m yade
}

bare() { # bare SUITE FOLDER: a root with what the README asks for, and this machine's way to the network
  mirror=${MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 2>/dev/null | grep '/debian/*$' | head -n 1)}
  recipe=/usr/share/debootstrap/scripts/$1
  [ -e "$recipe" ] || recipe=${recipe%/*}/sid # a debootstrap that is older than the suite
  debootstrap --variant=minbase --include=ca-certificates,git,make,python3 "$1" "$2" ${mirror:+"$mirror" "$recipe"} >"$2.log" ||
    { tail -n 5 "$2.log" >&2; exit 1; }
  for file in /etc/resolv.conf /etc/hosts /etc/pip.conf; do [ ! -e $file ] || cp -L $file "$2$file"; done
  cp -r /usr/local/share/ca-certificates "$2/usr/local/share/"
  apt-config dump | grep -E '^Acquire::(Check-|https?::)' >"$2/etc/apt/apt.conf.d/99network" || true
  printf '#!/bin/sh\nexit 101\n' >"$2/usr/sbin/policy-rc.d" # no package starts a service
  chmod +x "$2/usr/sbin/policy-rc.d"
  chroot "$2" update-ca-certificates >/dev/null 2>&1
}

case ${1:-} in
system)
  apt-get update -qq
  $get ca-certificates make python3 >/dev/null
  make -s yade;;
install)
  python3 -m venv $place
  $place/bin/pip install -q --disable-pip-version-check --require-hashes -r requirements.lock
  $place/bin/python -m hatchling build -t wheel -d $place/wheel >/dev/null
  $place/bin/pip install -q --disable-pip-version-check --no-deps --no-index $place/wheel/*.whl
  ln -sf $place/bin/calibrator /usr/local/bin/calibrator;;
root)
  suite=${2:-trixie}
  [ "$(id -u)" = 0 ] || { echo "a root of $suite needs root: sudo make ..." >&2; exit 1; }
  unshare --mount true 2>/dev/null || { echo "no mounts are allowed here: build the Containerfile instead" >&2; exit 1; }
  command -v debootstrap >/dev/null || { apt-get update -qq; $get debootstrap debian-archive-keyring >/dev/null; }
  root=${ROOT:-$(mktemp -d "/var/tmp/calibrator-$suite.XXXXXX")}
  [ -n "${ROOT:-}" ] || trap 'rm -rf --one-file-system "$root" "$root.log"' EXIT
  [ -e "$root/usr/bin/make" ] || part "bare $suite" bare "$suite" "$root"
  chmod 755 "$root"
  rm -rf "$root/srv/calibrator"
  mkdir -p "$root/srv/calibrator"
  git ls-files -z --cached --others --exclude-standard | tar -c --null -T - | tar -xm --no-same-owner -C "$root/srv/calibrator"
  # Mounts and processes end with this one.
  unshare --mount --pid --fork --kill-child --propagation private sh -c '
    mount -t proc proc "$1/proc" && mount --rbind /dev "$1/dev" && mount -t tmpfs tmpfs "$1/tmp" || exit 1
    exec env -u PYTHONPATH -u VIRTUAL_ENV -u YADE -u TMPDIR -u PIP_FIND_LINKS HOME=/root PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
      chroot "$1" sh /srv/calibrator/delivery/debian.sh inside' sh "$root";;
inside)
  for one in ${PARTS:-demo tests container}; do
    case $one in
      demo) part "make demo" make -s demo;;
      tests) part "real-YADE tests" tests;;
      container) (container);;
      *) echo "no part $one" >&2; exit 2;;
    esac
  done;;
*) sed -n '2,7s/^# //p' "$0" >&2; exit 2;;
esac
