# The V4L2 camera on vivid: contract, every plain format, controls, exported buffers, 1,000 cycles.
# limit: 600
modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0 vid_cap_nr=10
export LAB_CAMERA=vivid.0 LAB_SIZE=320x180 LAB_INTERVAL_MS=100 LAB_PICTURES=/out
export LAB_FORMATS="GREY YUYV NV12 RGB3 BGR3"
"$LAB_BIN/lab_v4l2" --gtest_filter='*CameraContract*/YUYV:*CameraContract*/RGB3:*KernelCamera*:ColourBars*:KernelCycles*'
