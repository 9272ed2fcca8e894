#!/bin/sh
# root.sh FOLDER PACKAGE...: makes FOLDER a root file system with the run-time files of these
# installed Debian packages.
set -eu
root=$1
shift
mkdir -p "$root/usr/lib" "$root/usr/lib64" "$root/etc/ssl/certs" "$root/var/lib/dpkg/status.d" "$root/tmp" \
    "$root/opt/lookdown/calibrations"
ln -s usr/lib usr/lib64 "$root"
for package in "$@"; do
    # Copies libraries without the character set converters.
    dpkg-query --listfiles "$package" | grep -v /gconv/ | while read -r file; do
        case $file in
            # These folders are links to folders below /usr; package lists use the old paths.
            /lib/* | /lib64/*) file=/usr$file ;;
            /usr/lib/*) ;;
            *) continue ;;
        esac
        if [ -f "$file" ]; then cp --archive --parents "$file" "$root"; fi
    done
    install -D --mode=644 "/usr/share/doc/$package/copyright" "$root/usr/share/doc/$package/copyright"
    # Vulnerability scanners read the package list here.
    dpkg-query --status "$package" > "$root/var/lib/dpkg/status.d/$package"
done
cp --dereference /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"
cp /etc/debian_version /etc/os-release "$root/etc/"
chmod 1777 "$root/tmp"
echo 'lookdown:x:65532:65532:Lookdown:/opt/lookdown:/nonexistent' > "$root/etc/passwd"
echo 'lookdown:x:65532:' > "$root/etc/group"
echo 'hosts: files dns' > "$root/etc/nsswitch.conf"
# Makes volumes that are mounted here writable by the program.
chown 65532:65532 "$root/opt/lookdown/calibrations"
