#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Copyright the slsd authors
#
# make_guest.sh ROOT FOLDER FILE...: from a Debian in ROOT the disk, the kernel and the initial RAM disk of a guest of
# QEMU, with these programs and what they read in its /usr/local/bin. As root. It needs e2fsprogs, busybox-static, cpio and kmod.
set -euo pipefail
here=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")
root=$(readlink -f "$1")
folder=$(readlink -f "$2")
shift 2
files=()
for file; do files+=("$(readlink -f "$file")"); done

# Unpacked only: its package would make an initial RAM disk of 36 MB, which an emulated processor unpacks for long.
get_kernel() {
  local package
  package=$(apt-cache depends linux-image-amd64 | awk '/Depends: linux-image/ { print $2; exit }')
  [ "$(cat kernel.name 2>/dev/null)" != "$package" ] || return 0
  rm -rf kernel kernel.name linux-image-*.deb
  apt-get -qq download "$package" 2>/dev/null
  mkdir kernel
  dpkg-deb --fsys-tarfile "$package"_*.deb | tar -xp -C kernel
  rm "$package"_*.deb
  depmod -b "$PWD/kernel" "$(basename kernel/lib/modules/*)"
  echo "$package" >kernel.name
}

# modules FOLDER MODULE...: the files of these modules and of those that they need, in the order of their loading
modules() {
  local tree=$1 module
  shift
  for module; do modprobe -d "$tree" -S "$version" -a --show-depends "$module" | awk '/^insmod/ { print $2 }'; done |
    awk '!seen[$0]++'
}

# For the guest's own udev and modprobe: of 4,000 modules those that a part needs.
install_modules() {
  local file
  for file in $(modules kernel virtio_pci virtio_blk virtio_console virtio-gpu ext4 crc32c_generic vhci-hcd uvcvideo vivid veth \
    sch_netem); do
    install -D -m 644 "$file" "tree/usr/${file#"$PWD/kernel/"}"
  done
  cp "kernel/lib/modules/$version"/modules.{order,builtin,builtin.modinfo} "tree/usr/lib/modules/$version/"
  depmod -b "$PWD/tree" "$version"
}

make_initrd() {
  local file
  rm -rf initrd
  mkdir -p initrd/{bin,dev,proc,sys,new,modules}
  cp /bin/busybox initrd/bin/
  for file in $(modules kernel virtio_pci virtio_blk ext4 crc32c_generic); do
    cp "$file" initrd/modules/
    basename "$file" >>initrd/order
  done
  cat >initrd/init <<'INIT'
#!/bin/busybox sh
busybox() { /bin/busybox "$@"; }
busybox mount -t devtmpfs dev /dev
while read -r module; do busybox insmod "/modules/$module"; done </order
until [ -b /dev/vda ]; do busybox sleep 0.1; done
busybox mount -t ext4 -o noatime /dev/vda /new
busybox mount --move /dev /new/dev
exec /bin/busybox switch_root /new /lib/systemd/systemd
INIT
  chmod +x initrd/init
  (cd initrd && find . | cpio -o -H newc --quiet) >initrd.img
}

install_agent() {
  install -D -m 755 "$here/agent.py" tree/usr/local/libexec/agent.py
  cat >tree/etc/systemd/system/agent.service <<'UNIT'
[Unit]
Description=What the test asks for
After=multi-user.target
[Service]
Type=idle
ExecStart=/usr/local/libexec/agent.py
Restart=on-failure
KillMode=process
[Install]
WantedBy=multi-user.target
UNIT
  mkdir -p tree/etc/systemd/system/multi-user.target.wants
  ln -sf ../agent.service tree/etc/systemd/system/multi-user.target.wants/agent.service
  local unit
  for unit in apt-daily.timer apt-daily-upgrade.timer fstrim.timer dpkg-db-backup.timer e2scrub_all.timer e2scrub_reap.service \
    systemd-timesyncd.service getty@tty1.service serial-getty@ttyS0.service; do
    ln -sf /dev/null "tree/etc/systemd/system/$unit"
  done
}

cd "$folder"
get_kernel
version=$(basename kernel/lib/modules/*)
rm -rf tree
cp -a --reflink=auto "$root" tree
# Where nobody reads: a third of the disk.
rm -rf tree/packages tree/usr/share/{doc,man,locale,info} tree/var/{cache/apt,lib/apt/lists}
mkdir -p tree/packages
printf '/dev/vda / ext4 noatime 0 0\n/dev/vdb /packages ext4 ro 0 0\ntmpfs /tmp tmpfs mode=1777 0 0\n' >tree/etc/fstab
echo guest >tree/etc/hostname
ln -sf /lib/systemd/system/multi-user.target tree/etc/systemd/system/default.target
install_agent
install_modules
install -m 755 "${files[@]}" tree/usr/local/bin/
cp "kernel/boot/vmlinuz-$version" vmlinuz
make_initrd
rm -f disk.img
truncate -s 3G disk.img
mke2fs -q -t ext4 -O ^has_journal,^metadata_csum,^64bit -E lazy_itable_init=0,nodiscard -m0 -d tree disk.img
rm -rf tree initrd
