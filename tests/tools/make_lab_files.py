#!/usr/bin/env python3
"""Makes the files of tests/data/lab_files: small recordings and tables as the programs of laboratories write them, with their truth.

Needs numpy, scipy, h5py, hdf5storage, npTDMS, pyuff, lvmio and pandas from PyPI. Run it from the root of the repository; it writes
tests/data/lab_files/*. The truth of each file stands in truth.json: the options that the file needs, the words of the message without them,
and channels, rate, number of samples and first samples in SI units.
"""

import json
import math
import pathlib

import h5py
import hdf5storage
import lvmio
import numpy as np
import pandas as pd
import pyuff
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from scipy.io import savemat, wavfile

FOLDER = pathlib.Path(__file__).parents[1] / "data" / "lab_files"
G = 9.80665
RATE = 2048.0
COUNT = 128

t = np.arange(COUNT) / RATE
# A half-sine impact of 100 N, and the acceleration of a mode of 180 Hz after it.
force = np.where((t > 0.004) & (t < 0.008), 100 * np.sin(np.pi * (t - 0.004) / 0.004), 0.0)
acc = np.where(t > 0.004, 30 * np.exp(-40 * (t - 0.004)) * np.sin(2 * np.pi * 180 * (t - 0.004)), 0.0) + 0.01
acc_y = 0.3 * acc

truth = {}


def expect(name, channels, options=(), asks=(), rate=RATE, count=COUNT, records=1, kind="recording", digits=5, warns=(), constant=()):
    """Adds the truth of a file. channels: name -> samples in SI units; of several records those of the first."""
    truth[name] = {
        "kind": kind,
        "options": list(options),
        "asks": list(asks),
        "rate_hz": rate,
        "samples": count,
        "records": records,
        "relative_tolerance": 10.0**-digits,
        "warns": list(warns),
        "constant": list(constant),
        "channels": {
            key: {
                "first": float(values[0]),
                "peak": float(max(abs(values))),
                "samples_10_to_20": [float(value) for value in values[10:20]],
            }
            for key, values in channels.items()
        },
    }


def text(name, content, encoding="utf-8", newline="\n"):
    (FOLDER / name).write_bytes(content.replace("\n", newline).encode(encoding))


def rows(columns, separator=",", decimal=".", digits=8, end=""):
    lines = []
    for values in zip(*columns):
        lines.append(separator.join(f"{value:.{digits}g}".replace(".", decimal) for value in values) + end)
    return "\n".join(lines) + "\n"


both = {"fx": force, "ax": acc}
three = {"fx": force, "ax": acc, "ay": acc_y}


def csv_files():
    table = [t, force, acc / G]
    text("round_brackets.csv", "Time (s),Force (N),Acceleration (g)\n" + rows(table))
    expect("round_brackets.csv", both, ["--map", "Force=fx,Acceleration=ax"], ["Force=fx", "direction"])
    text("square_brackets_words.csv", "Time [s],Hammer X [N],Acc X [g],Acc Y [g]\n" + rows(table + [acc_y / G]))
    expect("square_brackets_words.csv", three)
    text("hammer_without_direction.csv", "Time [s],Hammer [N],Acc X [g],Acc Y [g]\n" + rows(table + [acc_y / G]))
    expect("hammer_without_direction.csv", three, ["--map", "Hammer=fx"], ["Hammer=fx"])
    text("names_only.csv", "t,force,acc\n" + rows([t, force, acc]))
    expect("names_only.csv", both, ["--map", "force=fx:N,acc=ax:m/s^2"], ["unit", "force=fx:N,acc=ax:m/s^2"])
    text("row_of_units.csv", "Time,Force X,Accel X\n(s),(N),(m/s^2)\n" + rows([t, force, acc]))
    expect("row_of_units.csv", both)
    text("row_of_units_bare.csv", "Time;Force X;Accel X\ns;N;m/s²\n" + rows([t, force, acc], ";"))
    expect("row_of_units_bare.csv", both)
    german = "Messung;17.03.2024\nBearbeiter;Muster\nMaschine;Fräse 3\n\nZeit [s];Kraft X [N];Beschleunigung X [m/s²]\n"
    text("german_spreadsheet.csv", german + rows([t, force, acc], ";", ","), "latin-1", "\r\n")
    expect("german_spreadsheet.csv", both)
    text("german_kilonewton.csv", "Zeit in ms;Kraft X in kN;Beschl. X in g\n" + rows([1e3 * t, 1e-3 * force, acc / G], ";", ","))
    expect("german_kilonewton.csv", both)
    text("trailing_commas.csv", "Time (s),Force X (N),Acc X (g),\n" + rows(table, end=","))
    expect("trailing_commas.csv", both)
    text("empty_last_column.csv", "Time (s),Force X (N),Acc X (g),Comment\n" + rows(table, end=","))
    expect("empty_last_column.csv", both)
    text("bom_and_comments.csv", "# tap test\n% second comment\nTime (s),Force X (N),Acc X (g)\n" + rows(table), "utf-8-sig")
    expect("bom_and_comments.csv", both)
    text("without_time.csv", "Force X [N],Acc X [g]\n" + rows(table[1:]))
    expect("without_time.csv", both, ["--rate", "2048"], ["--rate"])
    text("rate_in_head.csv", "Device: logger 4\nSample Rate: 2.048 kHz\nForce X [N],Acc X [g]\n" + rows(table[1:]))
    expect("rate_in_head.csv", both)
    text("fs_in_comment.csv", "# Fs = 2048\nForce X [N],Acc X [g]\n" + rows(table[1:]))
    expect("fs_in_comment.csv", both)
    frame = pd.DataFrame({"time_s": t, "force_x_N": force, "acc_x_g": acc / G})
    frame.to_csv(FOLDER / "pandas_index.csv")
    expect("pandas_index.csv", both)
    frame.to_csv(FOLDER / "pandas_tab.tsv", sep="\t", index=False)
    expect("pandas_tab.tsv", both)
    np.savetxt(FOLDER / "numpy_header.txt", np.column_stack([t, force, acc]), header="t fx ax", fmt="%.8g")
    expect("numpy_header.txt", both, ["--map", "fx=fx:N,ax=ax:m/s^2"])
    np.savetxt(FOLDER / "numpy_plain.dat", np.column_stack([t, force, acc]), fmt="%.8g")
    expect("numpy_plain.dat", both, ["--map", "1=t:s,2=fx:N,3=ax:m/s^2"], ["row of names", "1=t:s,2=fx:N,3=ax:m/s^2"])
    wide = "   Time (s)   Force X (N)   Acc X (m/s^2)\n"
    text("white_space.txt", wide + rows([t, force, acc], "   "))
    expect("white_space.txt", both)
    volts = [t, force * 2.2e-3, acc / G * 10.2e-3]
    text("volts.csv", "Time [s],Force X [V],Acc X [V]\n" + rows(volts))
    expect("volts.csv", both, ["--map", "Force X=fx:2.2 mV/N,Acc X=ax:10.2 mV/g"], ["sensitivity", "mV/N"])
    text("units_of_the_shop.csv", "Time [ms],Force X [lbf],Disp X [µm],Acc X [in/s²]\n"
         + rows([1e3 * t, force / 4.4482216152605, 1e6 * 1e-5 * np.sin(50 * t), acc / 0.0254]))
    expect("units_of_the_shop.csv", {"fx": force, "x": 1e-5 * np.sin(50 * t), "ax": acc})
    text("against_the_axis.csv", "Time [s],Force X [N],Acc -X [g]\n" + rows([t, force, -acc / G]))
    expect("against_the_axis.csv", both, ["--map", "Acc -X=-ax"], ["sign", "Acc -X=-ax"])
    text("two_sensors.csv", "Time [s],Force X [N],Acc1 X [g],Acc2 X [g]\n" + rows([t, force, acc / G, acc_y / G]))
    expect("two_sensors.csv", both | {"ax_2": acc_y}, ["--map", "Acc2 X=ax_2"], ["several sensors", "Acc2 X=ax_2"])


def csv_files_with_doubts():
    x = 1e-5 * np.sin(2 * np.pi * 80 * t)
    a = -((2 * np.pi * 80) ** 2) * x
    text("unit_wrong_by_gravity.csv", "Time [s],Force X [N],Disp X [mm],Acc X [g]\n" + rows([t, force, 1e3 * x, a]))
    expect("unit_wrong_by_gravity.csv", {"fx": force, "x": x, "ax": a * G}, warns=["9.81"])
    text("unit_wrong_by_1000.csv", "Time [s],Force X [N],Disp X [m],Acc X [m/s²]\n" + rows([t, force, 1e3 * x, a]))
    expect("unit_wrong_by_1000.csv", {"fx": force, "x": 1e3 * x, "ax": a}, warns=["1000"])
    text("constant_channel.csv", "Time [s],Force X [N],Acc X [g]\n" + rows([t, force, np.full(COUNT, 0.5)]))
    expect("constant_channel.csv", {"fx": force, "ax": np.full(COUNT, 0.5 * G)}, constant=["ax"])


def csv_files_of_loggers():
    table = [t, force, acc / G]
    head = "Time [s],Force X [N],Acc X [g]\n"
    text("utf16.csv", head + rows(table), "utf-16", "\r\n")
    expect("utf16.csv", both)
    text("old_line_ends.csv", head + rows(table), newline="\r")
    expect("old_line_ends.csv", both)
    text("name_twice.csv", "Time [s],Force X [N],Acc X [g],Acc X [g]\n" + rows(table + [acc_y / G]))
    expect("name_twice.csv", both | {"ax_2": acc_y}, ["--map", "4=ax_2"], ["several sensors", "Acc X (2)=ax_2"])
    text("comma_in_name.csv", 'Time [s],"Input 1, Hammer [N]",Acc X [g]\n' + rows(table))
    expect("comma_in_name.csv", both, ["--map", "Input 1, Hammer=fx"], ["Input 1, Hammer=fx"])
    text("speed_column.csv", "Time [s],Force X [N],Acc X [g],Tacho [rpm]\n" + rows(table + [np.full(COUNT, 6000.0)]))
    expect("speed_column.csv", both)
    text("axis_of_time.csv", "X [s],Force X [N],Acc X [g]\n" + rows(table))
    expect("axis_of_time.csv", both)

    def stamped(name, stamp):
        lines = [f"{stamp(second)},{one:.8g},{other:.8g}" for second, one, other in zip(t, force, acc / G)]
        text(name, "Time,Force X [N],Acc X [g]\n" + "\n".join(lines) + "\n")
        expect(name, both)

    stamped("clock_times.csv", lambda second: f"14:03:{20 + second:09.6f}")
    stamped("date_times.csv", lambda second: f"2024-05-03T23:59:{59.95 + second:09.6f}Z" if second < 0.05 else f"2024-05-04T00:00:{second - 0.05:09.6f}Z")
    quoted = "".join(f'{second:.8g},"{1e3 * one:,.6f}",{other:.8g}\n' for second, one, other in zip(t, force, acc / G))
    text("thousands.csv", "Time [s],Force X [mN],Acc X [g]\n" + quoted)
    expect("thousands.csv", both)
    fortran = "".join(f" {second:.9E} {one:.9E} {other:.9E}\n".replace("E", "D") for second, one, other in zip(t, force, acc / G))
    text("fortran_exponents.dat", " TIME(s) FORCE_X(N) ACC_X(G)\n" + fortran)
    expect("fortran_exponents.dat", both)
    text("statistics_after.csv", head + rows(table) + "Mean,1.5,0.2\nRMS,3.5,1.2\n\nend of record\n")
    expect("statistics_after.csv", both)
    text("cut_off_line.csv", head + rows(table) + "0.0625,1")
    expect("cut_off_line.csv", both)
    text("no_header.lvm", rows([t, force, acc], "\t"))
    expect("no_header.lvm", both, ["--map", "1=t:s,2=fx:N,3=ax:m/s^2"], ["1=t:s,2=fx:N,3=ax:m/s^2"])
    text("without_ending", head + rows(table))
    expect("without_ending", both)


def save_level_7_3(path, variables, do_compression=False):
    """Writes a MAT-file of level 7.3, which is an HDF5 file, as MATLAB does: small arrays plain, large ones compressed."""
    threshold = 0 if do_compression else 1 << 20
    path.unlink(missing_ok=True)
    options = hdf5storage.Options(matlab_compatible=True, store_python_metadata=False, oned_as="column", compress_size_threshold=threshold)
    hdf5storage.writes(variables, filename=str(path), options=options)


def mat_files():
    for prefix, save in {"": savemat, "hdf5_": save_level_7_3}.items():
        mat_files_of_level(prefix, save)
    # Chunks of rows and columns that do not divide the matrix, as matfile and h5py write them.
    with h5py.File(FOLDER / "hdf5_chunks.mat", "w", userblock_size=512) as file:
        data = np.vstack([force, acc / G, acc_y / G])
        for name, values, chunks in [("data", data, (2, 50)), ("Fs", np.array([[RATE]]), None)]:
            file.create_dataset(name, data=values, chunks=chunks, compression=chunks and "gzip", shuffle=chunks is not None)
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created by h5py".ljust(116) + bytes(8) + b"\0\2IM"
    with open(FOLDER / "hdf5_chunks.mat", "r+b") as file:
        file.write(head)
    expect("hdf5_chunks.mat", three, ["--map", "data1=fx:N,data2=ax:g,data3=ay:g"], ["data1=fx:N"], digits=12)


def mat_files_of_level(prefix, save_file):
    def save(name, variables, **options):
        save_file(FOLDER / (prefix + name), variables, **options)

    def expects(name, *arguments, **options):
        expect(prefix + name, *arguments, digits=12, **options)

    save("flat.mat", {"t": t, "fx": force, "ax": acc})
    expects("flat.mat", both, ["--map", "fx=fx:N,ax=ax:m/s^2"])
    save("oscilloscope.mat", {"A": force * 2.2e-3, "B": acc / G * 10e-3, "Tinterval": 1 / RATE})
    expects("oscilloscope.mat", both, ["--map", "A=fx:2.2 mV/N,B=ax:10 mV/g"])
    save("flat_fs.mat", {"F": force, "A": acc, "Fs": RATE}, do_compression=True)
    names = "F=fx:N,A=ax:m/s^2" if prefix == "" else "A=ax:m/s^2,F=fx:N"
    expects("flat_fs.mat", both, ["--map", "F=fx:N,A=ax:m/s^2"], [names])
    save("matrix_columns.mat", {"data": np.column_stack([force, acc, acc_y]), "Fs": RATE})
    expects("matrix_columns.mat", three, ["--map", "data1=fx:N,data2=ax:m/s^2,data3=ay:m/s^2"], ["data1=fx:N"])
    save("matrix_rows.mat", {"data": np.vstack([force, acc, acc_y]), "dt": 1 / RATE})
    expects("matrix_rows.mat", three, ["--map", "data1=fx:N,data2=ax:m/s^2,data3=ay:m/s^2"], ["data1=fx:N"])
    save("matrix_with_time.mat", {"data": np.column_stack([t, force, acc])})
    expects("matrix_with_time.mat", both, ["--map", "data1=t:s,data2=fx:N,data3=ax:m/s^2"], ["data1=t:s,data2=fx:N"])
    save("struct.mat", {"data": {"time": t, "force": force, "acc": acc, "Fs": RATE}})
    expects("struct.mat", both, ["--map", "force=fx:N,acc=ax:m/s^2"], ["force=fx:N,acc=ax:m/s^2"])
    save("struct_units.mat", {"data": {"force_x": force, "acc_x": acc / G, "Fs": RATE, "units": {"force_x": "N", "acc_x": "g"}}})
    expects("struct_units.mat", both)
    nested = {"test": {"force_x": {"values": force, "unit": "N"}, "acc_x": {"values": acc, "unit": "m/s^2"}, "Fs": RATE}}
    save("struct_nested.mat", {"data": nested})
    expects("struct_nested.mat", both)
    impacts = np.zeros((3,), dtype=[("time", object), ("force_x_N", object), ("acc_x_g", object)])
    for index in range(3):
        impacts[index] = (t, (index + 1) * force, (index + 1) * acc / G)
    save("struct_array.mat", {"impacts": impacts})
    expects("struct_array.mat", both, records=3)


def logger_files():
    channels = [
        lvmio.Channel("Hammer X", list(force), unit="N", delta_x=1 / RATE),
        lvmio.Channel("Acc X", list(acc / G), unit="g", delta_x=1 / RATE),
    ]
    for name, options in {
        "one_x_column.lvm": {},
        "no_x_column.lvm": {"x_columns": "No"},
        "many_x_columns.lvm": {"x_columns": "Multi"},
        "comma_separated.lvm": {"separator": "Comma"},
        "decimal_comma.lvm": {"decimal_separator": ","},
    }.items():
        lvmio.write_lvm(FOLDER / name, lvmio.Segment(channels), precision=9, **options)
        expect(name, both)
    lvmio.write_lvm(FOLDER / "two_blocks.lvm", lvmio.LvmFile([lvmio.Segment(channels), lvmio.Segment(channels)]), precision=9)
    expect("two_blocks.lvm", both, records=2)

    def tdms(name, groups):
        with TdmsWriter(FOLDER / name) as writer:
            writer.write_segment([RootObject({"operator": "lab"})])
            for group, data in groups.items():
                objects = [GroupObject(group, {})]
                for channel, (unit, samples) in data.items():
                    properties = {"wf_increment": 1 / RATE, "wf_start_offset": 0.0, "unit_string": unit}
                    objects.append(ChannelObject(group, channel, samples, properties))
                writer.write_segment(objects)

    tdms("group.tdms", {"taps": {"Force X": ("N", force), "Acc X": ("g", acc / G)}})
    expect("group.tdms", both, digits=12)
    tdms("single_precision.tdms", {"taps": {"Force X": ("N", force.astype(np.float32)), "Acc X": ("m/s^2", acc.astype(np.float32))}})
    expect("single_precision.tdms", both)
    tdms("groups.tdms", {f"impact {k}": {"Force X": ("N", force), "Acc X": ("g", acc / G)} for k in (1, 2, 3)})
    expect("groups.tdms", both, records=3, digits=12)
    tdms("without_direction.tdms", {"taps": {"Hammer": ("N", force), "Accel": ("g", acc / G)}})
    expect("without_direction.tdms", both, ["--map", "Hammer=fx,Accel=ax"], ["Hammer=fx,Accel=ax"], digits=12)


def uff_files():
    def time_set(samples, kind, unit, direction, reference=1, **more):
        return {
            "type": 58, "func_type": 1, "rsp_node": 1, "rsp_dir": direction, "ref_node": 1, "ref_dir": reference,
            "data": samples, "x": t, "id1": "tap", "rsp_ent_name": "NONE", "ref_ent_name": "NONE",
            "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s",
            "ordinate_spec_data_type": kind, "ordinate_axis_units_lab": unit, "orddenom_spec_data_type": 0,
            "ordinate_axis_lab": "NONE", "abscissa_axis_lab": "NONE", **more,
        }

    head = {"type": 151, "model_name": "cell", "description": "NONE", "db_app": "test", "program": "test"}
    units = {
        "type": 164, "units_code": 1, "units_description": "SI", "temp_mode": 1,
        "length": 1.0, "force": 1.0, "temp": 1.0, "temp_offset": 273.15,
    }
    sets = [time_set(force, 13, "N", 1), time_set(acc, 12, "m/s^2", 1)]
    path = FOLDER / "time.uff"
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets([head, units] + sets, "overwrite")
    expect("time.uff", both)
    # pyuff loses binary data sets in the mode "overwrite"; to an empty file it adds them all.
    path = FOLDER / "time_binary.uff"
    path.write_bytes(b"")
    pyuff.UFF(str(path)).write_sets([dict(one, binary=1) for one in sets], "add")
    expect("time_binary.uff", both)
    path = FOLDER / "against_the_axis.uff"
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets([time_set(force, 13, "N", 1), time_set(-acc / G, 12, "g", -1)], "overwrite")
    expect("against_the_axis.uff", both)
    frequencies, h = receptance()
    omega = 2 * np.pi * frequencies
    frf = {
        "type": 58, "func_type": 4, "rsp_node": 1, "rsp_dir": 1, "ref_node": 1, "ref_dir": 1, "data": -h * omega**2, "x": frequencies,
        "id1": "frf", "rsp_ent_name": "NONE", "ref_ent_name": "NONE", "abscissa_spacing": 1, "abscissa_spec_data_type": 18,
        "ordinate_spec_data_type": 12, "ordinate_axis_units_lab": "m/s^2", "orddenom_spec_data_type": 13, "orddenom_axis_units_lab": "N",
        "abscissa_axis_units_lab": "Hz", "ordinate_axis_lab": "NONE", "abscissa_axis_lab": "NONE",
    }
    path = FOLDER / "accelerance.uff"
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets([frf], "overwrite")
    expect_frf("accelerance.uff", {"xx": h}, digits=4)

    def frf_file(name, sets):
        path = FOLDER / name
        path.write_bytes(b"")
        pyuff.UFF(str(path)).write_sets(sets, "add")

    # pyuff states the bytes of complex functions as if they were real.
    frf_file("binary_accelerance.uff", [dict(frf, binary=1)])
    expect_frf("binary_accelerance.uff", {"xx": h}, digits=4)
    roving = [dict(frf, ref_node=node, data=-h * omega**2 / node) for node in (1, 2, 3)]
    frf_file("roving_hammer.uff", roving)
    expect_frf("roving_hammer.uff", {"xx": h}, digits=4)
    frf_file("two_drive_points.uff", roving + [dict(frf, rsp_node=2, ref_node=2, data=-h * omega**2 / 4)])
    expect_frf("two_drive_points.uff", {"xx": h}, ["--map", "1=hxx"], ["twice", "node 2", "--map 1=hxx"], digits=4)
    frf_file("frf_without_direction.uff", [dict(frf, rsp_dir=0, ref_dir=0)])
    expect_frf("frf_without_direction.uff", {"yy": h}, ["--map", "1=hyy"], ["direction 0", "--map 1=hxx"], digits=4)
    ratio = dict(frf, data=-h * omega**2 / G, ordinate_axis_units_lab="g/N")
    frf_file("ratio_in_label.uff", [ratio])
    expect_frf("ratio_in_label.uff", {"xx": h}, digits=4)


def wav_files():
    full = 200.0
    for name, data, digits in [
        ("sixteen_bits.wav", np.round(acc / full * 32767).astype(np.int16), 2),
        ("thirty_two_bits.wav", np.round(acc / full * 2147483647).astype(np.int32), 4),
        ("floats.wav", (acc / full).astype(np.float32), 4),
    ]:
        wavfile.write(FOLDER / name, int(RATE), data)
        scale = full * (32768 / 32767 if data.dtype == np.int16 else 1)
        expect(name, {"ax": acc}, ["--map", f"ch1=ax:{scale!r} m/s^2"], digits=digits)


def receptance():
    frequencies = np.arange(20.0, 60.0, 0.5)
    r = frequencies / 40.0
    return frequencies, 1e-7 / (1 - r**2 + 2j * 0.03 * r)


def expect_frf(name, responses, options=(), asks=(), digits=5):
    frequencies, h = receptance()
    truth[name] = {
        "kind": "frf", "options": list(options), "asks": list(asks), "lines": len(frequencies),
        "frequency_hz": [float(frequencies[0]), float(frequencies[-1])], "relative_tolerance": 10.0**-digits,
        "receptances": {
            key: {"peak_hz": float(frequencies[np.argmax(abs(value))]), "peak_m_per_n": float(max(abs(value)))}
            for key, value in responses.items()
        },
    }


def frf_tables():
    f, h = receptance()
    omega = 2 * np.pi * f
    text("frf_names_only.csv", "Frequency (Hz),Real,Imag\n" + rows([f, h.real, h.imag]))
    expect_frf("frf_names_only.csv", {"xx": h}, ["--map", "Real=hxx_re:m/N,Imag=hxx_im:m/N"], ["directions", "Real=hxx_re:m/N,Imag=hxx_im:m/N"])
    phase = np.degrees(np.angle(h))
    text("frf_magnitude_phase.csv", "Freq [Hz];Mag Hxx [µm/N];Phase Hxx [deg]\n" + rows([f, 1e6 * abs(h), phase], ";", ","))
    expect_frf("frf_magnitude_phase.csv", {"xx": h})
    text("frf_mag_without_unit.csv", "Freq;Mag;Phase\n" + rows([f, abs(h), phase], ";"))
    expect_frf("frf_mag_without_unit.csv", {"yy": h}, ["--map", "Mag=hyy_mag:m/N,Phase=hyy_phase:deg"], ["Mag=hxx_mag:m/N,Phase=hxx_phase:deg"])
    text("frf_radians.csv", "Frequency (Hz),Hxx Mag (m/N),Hxx Phase (rad)\n" + rows([f, abs(h), np.angle(h)]))
    expect_frf("frf_radians.csv", {"xx": h})
    text("frf_decibel.csv", "Frequency (Hz),Hxx (dB re 1 m/N),Hxx Phase (deg)\n" + rows([f, 20 * np.log10(abs(h)), phase]))
    expect_frf("frf_decibel.csv", {"xx": h})
    v = h * 1j * omega
    text("frf_mobility.txt", "f [Hz]\tHxx real [(m/s)/N]\tHxx imag [(m/s)/N]\n" + rows([f, v.real, v.imag], "\t"))
    expect_frf("frf_mobility.txt", {"xx": h})
    a = -h * omega**2
    text("frf_accelerance.csv", "Frequency (Hz),Real Hxx (g/N),Imag Hxx (g/N)\n" + rows([f, a.real / G, a.imag / G]))
    expect_frf("frf_accelerance.csv", {"xx": h})
    text("frf_side_by_side.csv", "Frequency (Hz),Hxx Real (m/N),Hxx Imag (m/N),Hyx Real (m/N),Hyx Imag (m/N),Coherence xx\n"
         + rows([f, h.real, h.imag, 0.1 * h.real, 0.1 * h.imag, np.full(len(f), 0.99)]))
    expect_frf("frf_side_by_side.csv", {"xx": h, "yx": 0.1 * h})
    text("frf_row_of_units.txt", "Linear\tReal\tImaginary\nHz\tg/N\tg/N\n" + rows([f, a.real / G, a.imag / G], "\t"))
    expect_frf("frf_row_of_units.txt", {"xx": h}, ["--map", "Real=hxx_re,Imaginary=hxx_im"], ["Real=hxx_re,Imaginary=hxx_im"])
    text("frf_units_of_ratio.txt", "X-axis\tFRF TIP:+X/HAMM:+X (Real)\tFRF TIP:+X/HAMM:+X (Imag)\nHz\t(m/s^2)/N\t(m/s^2)/N\n" + rows([f, a.real, a.imag], "\t"))
    expect_frf("frf_units_of_ratio.txt", {"xx": h})
    text("frf_level_and_phase.csv", "Frequency [Hz];Level [dB re 1 g/N];Phase [deg]\n" + rows([f, 20 * np.log10(abs(a) / G), np.degrees(np.angle(a))], ";"))
    expect_frf("frf_level_and_phase.csv", {"xx": h}, ["--map", "Level=hxx_db,Phase=hxx_phase"], ["Level=hxx_db,Phase=hxx_phase"])
    text("frf_modulus.csv", "f [Hz];|Y| [m/(N·s)];arg Y [°]\n" + rows([f, abs(v), np.degrees(np.angle(v))], ";"))
    expect_frf("frf_modulus.csv", {"zz": h}, ["--map", "|Y|=hzz_mag,arg Y=hzz_phase"], ["|Y|=hxx_mag,arg Y=hxx_phase"])
    text("frf_all_forms.csv", "Frequency (Hz),Hyy Real (m/N),Hyy Imag (m/N),Hyy Mag (m/N),Hyy Phase (deg)\n" + rows([f, h.real, h.imag, abs(h), phase]))
    expect_frf("frf_all_forms.csv", {"yy": h})
    text("frf_all_forms_without_direction.csv", "Frequency (Hz),Real (m/N),Imag (m/N),Mag (m/N),Phase (deg)\n" + rows([f, h.real, h.imag, abs(h), phase]))
    expect_frf("frf_all_forms_without_direction.csv", {"yy": h}, ["--map", "Real (m/N)=hyy_re,Imag (m/N)=hyy_im"], ["Real (m/N)=hxx_re,Imag (m/N)=hxx_im"])
    text("frf_complex.csv", "freq_hz,H\n" + "".join(f"{hertz:.6g},{value.real:.9e}{value.imag:+.9e}i\n" for hertz, value in zip(f, h)))
    expect_frf("frf_complex.csv", {"xx": h}, ["--map", "H real=hxx_re:m/N,H imag=hxx_im:m/N"], ["H real=hxx_re:m/N,H imag=hxx_im:m/N"])
    np.savetxt(FOLDER / "frf_complex.txt", np.column_stack([f, h]))
    expect_frf("frf_complex.txt", {"xx": h}, ["--map", "1=frequency_hz,3=hxx_re:m/N,4=hxx_im:m/N"])
    text("frf_no_head.frf", rows([f, h.real, h.imag], " "))
    expect_frf("frf_no_head.frf", {"xx": h}, ["--map", "1=frequency_hz,2=hxx_re:m/N,3=hxx_im:m/N"], ["1=frequency_hz,2=hxx_re:m/N,3=hxx_im:m/N"])
    savemat(FOLDER / "frf_complex.mat", {"f": f, "H": h})
    expect_frf("frf_complex.mat", {"xx": h}, ["--map", "H real=hxx_re:m/N,H imag=hxx_im:m/N"], ["H real=hxx_re:m/N,H imag=hxx_im:m/N"])


def bad_files():
    def refused(name, *words):
        expect(name, {}, asks=words, kind="refused")

    text("bad_empty.csv", "")
    refused("bad_empty.csv", "empty")
    text("bad_text_in_numbers.csv", "Time [s],Force X [N],Acc X [g]\n0,1,2\n0.1,2,broken\n0.2,3,4\n")
    refused("bad_text_in_numbers.csv", "line 3", "broken", "Acc X")
    text("bad_swapped_units.csv", "Time [s],Force X [g],Acc X [N]\n0,1,2\n0.1,2,3\n0.2,3,4\n")
    refused("bad_swapped_units.csv", "Force X", "acceleration", "force")
    text("bad_gap_in_time.csv", "Time [s],Force X [N]\n0,1\n0.1,2\n0.5,3\n0.6,4\n")
    refused("bad_gap_in_time.csv", "not even")
    text("bad_not_a_number.csv", "Time [s],Force X [N]\n0,1\n0.1,nan\n0.2,3\n")
    refused("bad_not_a_number.csv", "line 3", "nan")
    text("bad_missing_value.csv", "Time [s],Force X [N]\n0,1\n0.1,OVR\n0.2,3\n")
    refused("bad_missing_value.csv", "line 3", "OVR", "--until-s")
    text("bad_dynamic_stiffness.csv", "Frequency (Hz),Real (N/um),Imag (N/um)\n1,2,3\n2,3,4\n")
    refused("bad_dynamic_stiffness.csv", "force per motion", "m/N")
    (FOLDER / "bad_spreadsheet.xlsx").write_bytes(b"PK\x03\x04" + bytes(60))
    refused("bad_spreadsheet.xlsx", "xlsx", "csv")
    savemat(FOLDER / "bad_text_only.mat", {"note": "nothing measured"})
    refused("bad_text_only.mat", "no numeric vector")
    save_level_7_3(FOLDER / "bad_hdf5_text_only.mat", {"note": "nothing measured"})
    refused("bad_hdf5_text_only.mat", "no numeric vector")
    save_level_7_3(FOLDER / "bad_hdf5_not_a_number.mat", {"t": t, "ch": np.where(t == t[2], np.nan, t)})
    refused("bad_hdf5_not_a_number.mat", '"ch": sample 3', "NaN")
    (FOLDER / "bad_hdf5_cut_off.mat").write_bytes((FOLDER / "hdf5_struct.mat").read_bytes()[:-3000])
    refused("bad_hdf5_cut_off.mat", "cut off")


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    for old in FOLDER.iterdir():
        old.unlink()
    for make in (csv_files, csv_files_with_doubts, csv_files_of_loggers, mat_files, logger_files, uff_files, wav_files, frf_tables, bad_files):
        make()
    (FOLDER / "truth.json").write_text(json.dumps(truth, indent=1, sort_keys=True) + "\n")
    size = sum(path.stat().st_size for path in FOLDER.iterdir())
    print(f"{len(truth)} files, {size} bytes")


if __name__ == "__main__":
    main()
