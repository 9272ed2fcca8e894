import java.io.File;
import org.openapitools.client.ApiClient;
import org.openapitools.client.api.DetectionApi;
import org.openapitools.client.api.DetectionApi.APIDetectPersonsRequest;
import org.openapitools.client.model.Profile;

/** Sends a frame with the generated client: `Detect ADDRESS IMAGE`. Prints the number of persons. */
class Detect {
    public static void main(String[] arguments) throws Exception {
        ApiClient client = new ApiClient();
        client.updateBaseUri(arguments[0]);
        APIDetectPersonsRequest request = APIDetectPersonsRequest.newBuilder()
            .img(new File(arguments[1]))
            .calibration("office")
            .profile(Profile.FAST)
            .build();
        System.out.println(new DetectionApi(client).detectPersons(request).getPersons().size());
    }
}
