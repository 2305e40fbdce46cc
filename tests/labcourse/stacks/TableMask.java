// The text's section 8: a colour range, in OpenCV's Java bindings, to a PNG mask; and the network, through the same.
//
// TableMask IMAGE H0 S0 V0 H1 S1 V1 MASK NETWORK LABELS
//   A lower hue above the upper one goes round through red. LABELS: PNG of the network's classes, for the whole image.

import org.opencv.core.Core;
import org.opencv.core.CvType;
import org.opencv.core.Mat;
import org.opencv.core.Scalar;
import org.opencv.core.Size;
import org.opencv.dnn.Dnn;
import org.opencv.dnn.Net;
import org.opencv.imgcodecs.Imgcodecs;
import org.opencv.imgproc.Imgproc;

public class TableMask {
    static {
        System.loadLibrary(Core.NATIVE_LIBRARY_NAME);
    }

    static Mat inRange(Mat bgr, double[] b) {
        Mat hsv = new Mat();
        Imgproc.cvtColor(bgr, hsv, Imgproc.COLOR_BGR2HSV);
        Mat mask = new Mat();
        if (b[0] <= b[3]) {
            Core.inRange(hsv, new Scalar(b[0], b[1], b[2]), new Scalar(b[3], b[4], b[5]), mask);
            return mask;
        }
        Mat above = new Mat();
        Core.inRange(hsv, new Scalar(b[0], b[1], b[2]), new Scalar(179, b[4], b[5]), above);
        Core.inRange(hsv, new Scalar(0, b[1], b[2]), new Scalar(b[3], b[4], b[5]), mask);
        Core.bitwise_or(above, mask, mask);
        return mask;
    }

    static Mat label(Net net, Mat bgr) {
        net.setInput(Dnn.blobFromImage(bgr, 1.0 / 255.0, new Size(), new Scalar(0, 0, 0), true, false));
        Mat scores = net.forward();
        int classes = scores.size(1), height = scores.size(2), width = scores.size(3);
        Mat planes = scores.reshape(1, classes); // one row a class, pixels in reading order: NCHW
        float[] plane = new float[height * width];
        float[] best = new float[height * width];
        byte[] labels = new byte[height * width];
        planes.get(0, 0, best);
        for (int c = 1; c < classes; ++c) {
            planes.get(c, 0, plane);
            for (int i = 0; i < plane.length; ++i) {
                if (plane[i] > best[i]) {
                    best[i] = plane[i];
                    labels[i] = (byte) c;
                }
            }
        }
        Mat mask = new Mat(height, width, CvType.CV_8UC1);
        mask.put(0, 0, labels);
        return mask;
    }

    public static void main(String[] arguments) {
        if (arguments.length != 10) {
            System.err.println("TableMask IMAGE H0 S0 V0 H1 S1 V1 MASK NETWORK LABELS");
            System.exit(2);
        }
        Mat bgr = Imgcodecs.imread(arguments[0]);
        if (bgr.empty()) {
            System.err.println("Could not load " + arguments[0]);
            System.exit(2);
        }
        double[] bounds = new double[6];
        for (int i = 0; i < 6; ++i) {
            bounds[i] = Double.parseDouble(arguments[1 + i]);
        }
        boolean written = Imgcodecs.imwrite(arguments[7], inRange(bgr, bounds));
        written &= Imgcodecs.imwrite(arguments[9], label(Dnn.readNetFromONNX(arguments[8]), bgr));
        System.exit(written ? 0 : 1);
    }
}
